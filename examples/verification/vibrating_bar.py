"""A bar that is held at one end swings along its axis."""
import numpy as np

from . import Number, finish, line, read, refine

TITLE = "Vibrating bar"
SHORT = "waves in an elastic bar, kept energy"
CHECKS = """A bar that is held at its left end starts with an even velocity (examples/vibrating-bar.json). A step of
stress runs to the free end and back. Momentum is a triangle in time. The example has the scheme USL, with which a
cell at the free end collapses when cells are halved; here the scheme is MUSL."""
REFERENCE = """The wave equation: c = sqrt(E / rho) = 10 m/s, period 4 L / c = 10 s, a free end that moves by v0 L / c
= 0.25 m."""
FIGURE = "momentum over time (points) and the triangle of the wave equation (line)"
SPEED, LENGTH, HEIGHT, VELOCITY, DENSITY = 10.0, 25.0, 0.5, 0.1, 1.0
PERIOD = 4 * LENGTH / SPEED


def scenarios(cell, step):
    case = refine(read("examples/vibrating-bar.json"), cell, step)
    case["mesh"]["structured"]["counts"][1] = 1
    case["mesh"]["structured"]["cell_size"][1] = HEIGHT  # one cell high
    case["analysis"]["mpm_scheme"] = "musl"
    case["post_processing"] = {"output_dt": 0.5, "history_dt": 0.05}
    return {"bar": case}


def zeros(history):
    """Times at which the momentum is zero."""
    time, p = history.time.to_numpy(), history.momentum_x.to_numpy()
    at = np.flatnonzero(p[:-1] * p[1:] < 0)
    return time[at] + (time[at + 1] - time[at]) * p[at] / (p[at] - p[at + 1])


def measure(runs):
    run = runs["bar"]
    crossings = zeros(run.history)
    start = run.history.kinetic.iloc[0]
    at_quarter = run.frames.at(time=PERIOD / 4)
    end = np.argmax(at_quarter["coordinates"][:, 0])
    energy = run.history.kinetic + run.history.internal
    return [
        Number("period", 4 * crossings[0], PERIOD, "s"),
        Number("period, from the last two zeros", 2 * (crossings[-1] - crossings[-2]), PERIOD, "s"),
        Number("motion of the free end", at_quarter["displacement_x"][end], VELOCITY * LENGTH / SPEED, "m"),
        Number("energy after two periods", energy.iloc[-1], start, "J"),
    ]


def draw(axes, results):
    history = results["(dt, h)"]["bar"].history
    mass = DENSITY * LENGTH * HEIGHT
    time = np.arange(0, 2 * PERIOD + 1e-9, PERIOD / 4)
    line(axes, time, VELOCITY * np.resize([1, 0, -1, 0], len(time)), "wave equation")
    axes.plot(history.time[::4], history.momentum_x[::4] / mass, "o", ms=3, label="bar")
    finish(axes, "time [s]", "mean velocity [m/s]")
