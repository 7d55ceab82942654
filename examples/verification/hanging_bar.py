"""A bar that hangs from the ceiling stretches under its own weight."""
import numpy as np

from . import GRAVITY, Number, finish, line, read, refine

TITLE = "Hanging bar"
SHORT = "elasticity in 3D, gravity, damping to rest"
CHECKS = """An elastic bar of 1 m hangs from the ceiling (examples/hanging-bar.json). Local damping brings it to rest.
Its stress along the axis and the sinking of its end follow from its weight."""
REFERENCE = "sigma = rho g z at the height z above the lower end; the end sinks by rho g L^2 / (2 E)."
FIGURE = "stress of particles (points) and that of the weight below (line)"
DENSITY, MODULUS, LENGTH = 1000.0, 2e6, 1.0


def scenarios(cell, step):
    return {"bar": refine(read("examples/hanging-bar.json"), cell, step)}


def measure(runs):
    frame = runs["bar"].frames[-1]
    z = frame["coordinates"][:, 2] - frame["displacement_z"]
    order = np.argsort(z)
    sinking = np.polyfit(z, frame["displacement_z"], 2)  # the solution is a parabola
    weight = DENSITY * GRAVITY * LENGTH
    slope = np.polyfit(z[order], frame["stress_zz"][order], 1)
    return [
        Number("sinking of the end", -np.polyval(sinking, 0.0), weight * LENGTH / 2 / MODULUS, "m"),
        Number("stress at the ceiling", np.polyval(slope, LENGTH), weight, "Pa"),
        Number("largest deviation of a stress", np.abs(frame["stress_zz"] - DENSITY * GRAVITY * z).max(), 0, "Pa",
               weight),
    ]


def draw(axes, results):
    frame = results["(dt, h)"]["bar"].frames[-1]
    z = frame["coordinates"][:, 2] - frame["displacement_z"]
    axes.plot(frame["stress_zz"] / 1e3, z, "o", ms=3, label="particles")
    line(axes, np.array([0, DENSITY * GRAVITY * LENGTH]) / 1e3, [0, LENGTH], "weight below")
    finish(axes, "stress along the axis [kPa]", "height [m]")
