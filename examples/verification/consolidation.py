"""A saturated column consolidates under a load (Terzaghi)."""
import numpy as np

from . import Number, finish, read, refine

TITLE = "Consolidation"
SHORT = "water in the pores, drainage, settlement"
CHECKS = """A column of saturated soil is loaded at its top (examples/consolidation.json). Water carries the load at
first. It drains at the top, and the soil takes over."""
REFERENCE = """Terzaghi (1923): u / q = sum of 2 / a sin(a d / H) exp(-a^2 T), a = (2 m + 1) pi / 2, T = c_v t / H^2.
The scale of pressures is the load q. The column settles by q H / M in the end, M being the oedometer's modulus.
Terzaghi leaves out that water is compressible: that is 0.1 % of the load."""
FIGURE = "pore pressure over height at several times: particles (points), Terzaghi (lines)"
LOAD, HEIGHT, E, NU, K = 1e4, 1.0, 1e7, 0.2, 1e-3
MODULUS = E * (1 - NU) / ((1 + NU) * (1 - 2 * NU))
RATE = K * MODULUS / (1000 * 9.81) / HEIGHT**2  # T over t [1/s]
ORDERS = np.pi * (2 * np.arange(200)[:, None] + 1) / 2


def pressure(depth, T):
    """Pore pressure over the load."""
    return np.sum(2 / ORDERS * np.sin(ORDERS * depth / HEIGHT) * np.exp(-ORDERS**2 * T), axis=0)


def degree(T):
    """Settlement over that in the end."""
    return 1 - np.sum(2 / ORDERS**2 * np.exp(-ORDERS**2 * T))


def scenarios(cell, step):
    case = refine(read("examples/consolidation.json"), cell, step)
    h = 0.05 * cell
    case["mesh"]["structured"]["counts"][0] = 1
    case["particles"][0]["generator"]["region"]["box"]["max"] = [h, HEIGHT]
    case["sets"]["particles"]["top"]["half_space"]["point"] = [0, HEIGHT - h / 2]  # the upper layer of particles
    return {"column": case}


def settlement(frame):
    """Motion of the top, by the two uppermost layers of particles."""
    y = frame["coordinates"][:, 1] - frame["displacement_y"]
    levels = np.unique(np.round(y, 9))[-2:]
    u = [frame["displacement_y"][np.isclose(y, level)].mean() for level in levels]
    return -(u[1] + (u[1] - u[0]) / (levels[1] - levels[0]) * (HEIGHT - levels[1]))


def measure(runs):
    frames = runs["column"].frames
    numbers = []
    for time in (0.264, 0.88):
        frame = frames.at(time=time)
        y, u = frame["coordinates"][:, 1], frame["pore_pressure"] / LOAD
        T = frame.time * RATE
        lowest = np.isclose(y, y.min(), atol=1e-6)
        base = pressure(np.array([HEIGHT - y.min()]), T)[0]
        deviation = np.abs(u - pressure(HEIGHT - y, T)).max()
        settled = degree(T) * LOAD * HEIGHT / MODULUS
        numbers += [
            Number(f"pressure at the base over the load, T = {T:.1f}", u[lowest].mean(), base, "", 1),
            Number(f"largest deviation over the load, T = {T:.1f}", deviation, 0, "", 1),
            Number(f"settlement, T = {T:.1f}", 1e3 * settlement(frame), 1e3 * settled, "mm"),
        ]
    return numbers


def draw(axes, results):
    frames = results["(dt, h)"]["column"].frames
    y = np.linspace(0, HEIGHT, 200)
    for index in (1, 3, 6, 12, 20):
        frame = frames[index]
        T = frame.time * RATE
        axes.plot(frame["pore_pressure"] / LOAD, frame["coordinates"][:, 1], "o", ms=3, color="tab:blue")
        axes.plot(pressure(HEIGHT - y, T), y, color="black", lw=1)
        axes.text(pressure(np.array([HEIGHT]), T)[0], 0.02, f"T = {T:.2f}", ha="right", fontsize=7)
    finish(axes, "pore pressure / load", "height [m]", legend=False)
