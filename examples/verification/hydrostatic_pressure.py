"""A fluid at rest carries the weight above."""
import numpy as np

from . import GRAVITY, Number, finish, line, read, refine

TITLE = "Hydrostatic pressure"
SHORT = "a fluid at rest in a tank"
CHECKS = """A tank is filled with a heavy, inviscid and rather compressible fluid (examples/hydrostatic-column.json).
Gravity acts at once, and damping brings the fluid to rest. Its pressure grows with the depth."""
REFERENCE = """p = rho g d at the depth d below the surface. The density changes by less than 0.2 %. The scale of the
scatter is the pressure at the floor."""
FIGURE = "pressure of particles (points) and of their depth (line)"
DENSITY, DEPTH = 1800.0, 0.1


def scenarios(cell, step):
    return {"tank": refine(read("examples/hydrostatic-column.json"), cell, step)}


def pressure(frame):
    return -(frame["stress_xx"] + frame["stress_yy"]) / 2


def measure(runs):
    frame = runs["tank"].frames[-1]
    y, p = frame["coordinates"][:, 1], pressure(frame)
    slope, floor = np.polyfit(y, p, 1)
    weight = DENSITY * GRAVITY * DEPTH
    return [
        Number("pressure at the floor", floor, weight, "Pa"),
        Number("gradient of the pressure", -slope, DENSITY * GRAVITY, "Pa/m"),
        Number("deviation of particles, root of the mean square",
               np.sqrt(np.mean((p - DENSITY * GRAVITY * (DEPTH - y))**2)), 0, "Pa", weight),
    ]


def draw(axes, results):
    frame = results["(dt, h)"]["tank"].frames[-1]
    axes.plot(pressure(frame), frame["coordinates"][:, 1], "o", ms=3, label="particles")
    line(axes, [DENSITY * GRAVITY * DEPTH, 0], [0, DEPTH], "rho g d")
    finish(axes, "pressure [Pa]", "height [m]")
