"""A block on a slope slides with Coulomb's friction, or sticks."""
import numpy as np

from . import GRAVITY, Number, finish, line, refine, scenario

TITLE = "Block on an incline"
SHORT = "Coulomb's friction at walls"
CHECKS = """An elastic block lies on a wall with friction. The axes of the mesh are those of the slope of 30 degrees,
so gravity is inclined. The velocity of the block shows the friction that acts."""
REFERENCE = """v = g t (sin b - mu cos b), and 0 where mu is above tan b = 0.577. The scale is the velocity without
friction."""
FIGURE = "velocity after 0.1 s over the coefficient of friction: runs (points), Coulomb (line)"
ANGLE, END = np.radians(30), 0.1
FRICTION = (0.0, 0.2, 0.4, 0.55, 0.7)


def scenarios(cell, step):
    return {f"friction-{mu}": block(mu, cell, step) for mu in FRICTION}


def block(mu, cell, step):
    return refine(scenario({
        "title": "Block on an incline",
        "mesh": {"structured": {"cell_size": 0.25, "extent": [3, 1]},
                 "boundary_conditions": {"walls": [{"nset": "slope", "normal": [0, 1], "friction": mu}]}},
        "sets": {"nodes": {"slope": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
        "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "rock",
                                     "region": {"box": {"min": [1, 0], "max": [2, 0.5]}}}}],
        "materials": [{"name": "rock", "type": "LinearElastic", "density": 1800, "youngs_modulus": 1e8,
                       "poisson_ratio": 0}],
        "external_loading_conditions": {"gravity": [GRAVITY * np.sin(ANGLE), -GRAVITY * np.cos(ANGLE)]},
        "analysis": {"dt": 1e-4, "end_time": END, "velocity_update": "pic", "shape_functions": "element"},
        "post_processing": {"output_steps": 1000, "history_steps": 10},
    }, "sliding-block"), cell, step)


def velocity(run):
    end = run.history.iloc[-1]
    return end.momentum_x / end.mass


def coulomb(mu):
    return GRAVITY * END * np.maximum(0, np.sin(ANGLE) - mu * np.cos(ANGLE))


def measure(runs):
    return [Number(f"velocity, mu = {mu}", velocity(runs[f"friction-{mu}"]), coulomb(mu), "m/s", coulomb(0))
            for mu in FRICTION]


def draw(axes, results):
    mu = np.linspace(0, 0.75, 200)
    line(axes, mu, coulomb(mu), "Coulomb")
    axes.plot(FRICTION, [velocity(run) for run in results["(dt, h)"].values()], "o", ms=5, label="runs")
    finish(axes, "coefficient of friction", "velocity [m/s]")
