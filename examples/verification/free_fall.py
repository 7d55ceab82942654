"""A block that is thrown: velocity, place, energy and spin are those of a mass point."""
import numpy as np

from . import GRAVITY, Number, finish, line, refine, scenario

TITLE = "Thrown block"
SHORT = "momentum, energy, path of the centre"
CHECKS = """An elastic block flies freely through the mesh. The sums over particles and nodes keep momentum, so the
velocity of its centre is right to rounding. The path has an error of the first order of the step: g t dt / 2."""
REFERENCE = """A mass point: v = v0 + g t, x = x0 + v0 t + g t^2 / 2. The scale of the path is its length upwards;
that of the energy is the kinetic energy at the start."""
FIGURE = "height of its centre (points) and the parabola (line)"
START, VELOCITY, END = (0.5, 0.5), (1.0, 3.0), 0.6
DENSITY, EDGE = 1000.0, 0.2


def scenarios(cell, step):
    return {"block": refine(scenario({
        "title": "Thrown block",
        "mesh": {"structured": {"cell_size": 0.05, "extent": [1.6, 1.2]}},
        "particles": [{"generator": {
            "type": "region", "per_cell": 2, "material": "rubber", "velocity": list(VELOCITY),
            "region": {"box": {"min": [x - EDGE / 2 for x in START], "max": [x + EDGE / 2 for x in START]}}}}],
        "materials": [{"name": "rubber", "type": "LinearElastic", "density": DENSITY, "youngs_modulus": 1e5,
                       "poisson_ratio": 0.3}],
        "external_loading_conditions": {"gravity": [0, -GRAVITY]},
        "analysis": {"dt": 1e-3, "end_time": END},
        "post_processing": {"output_dt": 0.03, "history_steps": 10},
    }, "free-fall"), cell, step)}


def centre(frame):
    return np.average(frame["coordinates"], axis=0, weights=frame["mass"])


def measure(runs):
    run = runs["block"]
    end, last = run.history.iloc[-1], run.frames[-1]
    fall = GRAVITY * END
    height = START[1] + VELOCITY[1] * END - GRAVITY * END**2 / 2
    kinetic = end.mass / 2 * (VELOCITY[0]**2 + (VELOCITY[1] - fall)**2)
    return [
        Number("mass", end.mass, DENSITY * EDGE**2, "kg"),
        Number("velocity along x", end.momentum_x / end.mass, VELOCITY[0], "m/s"),
        Number("velocity along y", end.momentum_y / end.mass, VELOCITY[1] - fall, "m/s"),
        Number("centre, x", centre(last)[0], START[0] + VELOCITY[0] * END, "m", VELOCITY[1]**2 / 2 / GRAVITY),
        Number("centre, y", centre(last)[1], height, "m", VELOCITY[1]**2 / 2 / GRAVITY),
        Number("kinetic energy", end.kinetic, kinetic, "J"),
        Number("balance of energy", end.balance, 0, "J", end.mass / 2 * (VELOCITY[0]**2 + VELOCITY[1]**2)),
    ]


def draw(axes, results):
    time = np.linspace(0, END, 100)
    line(axes, time, START[1] + VELOCITY[1] * time - GRAVITY * time**2 / 2, "mass point")
    frames = results["(dt, h)"]["block"].frames
    axes.plot(frames.times, [centre(frame)[1] for frame in frames], "o", ms=4, label="block")
    finish(axes, "time [s]", "height of the centre [m]")
