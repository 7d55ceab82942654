"""A disc on a rigid slope that cuts the mesh rolls, or slides."""
import numpy as np

from . import GRAVITY, Number, finish, line, refine, scenario

TITLE = "Rolling disc"
SHORT = "contact with a rigid body that cuts the mesh"
CHECKS = """An elastic disc lies on a rigid slope of 30 degrees, at an angle to the grid. With enough friction it
rolls; with less it slides and turns."""
REFERENCE = """A rigid disc: a = 2/3 g sin b where it rolls, mu >= tan(b) / 3 = 0.192; else g (sin b - mu cos b). The
scale is the velocity without friction."""
FIGURE = "velocity along the slope over the coefficient of friction: runs (points), rigid disc (line)"
SAYS = """The disc that rolls is slower than a rigid one, as if the normal force acted ahead of its centre. Half the
cell more than halves that."""
TOLERANCE = 1e-3
ANGLE, END, RADIUS = np.radians(30), 0.4, 0.2
ALONG, ABOVE = np.array([np.cos(ANGLE), -np.sin(ANGLE)]), np.array([np.sin(ANGLE), np.cos(ANGLE)])
POINT = np.array([0.5, 1.5])
FRICTION = (0.0, 0.1, 0.3, 0.6)


def scenarios(cell, step):
    return {f"friction-{mu}": disc(mu, cell, step) for mu in FRICTION}


def disc(mu, cell, step):
    return refine(scenario({
        "title": "Disc on a slope",
        "mesh": {"structured": {"cell_size": 0.05, "extent": [2, 2]}},
        "rigid_bodies": [{"name": "slope", "friction": mu,
                          "region": {"half_space": {"point": POINT, "normal": ABOVE}}}],
        "particles": [{"generator": {"type": "region", "per_cell": 3, "material": "rubber",
                                     "region": {"sphere": {"centre": POINT + RADIUS * ABOVE, "radius": RADIUS}}}}],
        "materials": [{"name": "rubber", "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                       "poisson_ratio": 0.3}],
        "external_loading_conditions": {"gravity": [0, -GRAVITY]},
        "analysis": {"end_time": END},
        "post_processing": {"output_dt": END / 2, "history_dt": 0.01},
    }, "rolling-disc"), cell, step)


def velocity(run):
    end = run.history.iloc[-1]
    return float(np.dot([end.momentum_x, end.momentum_y], ALONG) / end.mass)


def rigid(mu):
    slides = np.sin(ANGLE) - mu * np.cos(ANGLE)
    return GRAVITY * END * np.maximum(slides, 2 / 3 * np.sin(ANGLE))


def measure(runs):
    return [Number(f"velocity, mu = {mu}", velocity(runs[f"friction-{mu}"]), rigid(mu), "m/s", rigid(0))
            for mu in FRICTION]


def draw(axes, results):
    mu = np.linspace(0, 0.65, 200)
    line(axes, mu, rigid(mu), "rigid disc")
    axes.plot(FRICTION, [velocity(run) for run in results["(dt, h)"].values()], "o", ms=5, label="runs")
    axes.set_ylim(0)
    finish(axes, "coefficient of friction", "velocity along the slope [m/s]")
