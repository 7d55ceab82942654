"""Two elastic discs collide and part."""
import numpy as np

from . import FIRST, Number, finish, read, refine

TITLE = "Two discs"
SHORT = "collision through the mesh, kept energy"
CHECKS = """Two elastic discs fly towards each other, collide and part (examples/two-discs.json; Sulsky, Chen and
Schreyer 1994). Nothing but the mesh makes them feel each other."""
REFERENCE = """The momentum of both stays zero; kinetic and strain energy stay what they were. The scale of the
momentum is that of one disc."""
FIGURE = "kinetic energy, strain energy and their sum over time"


def scenarios(cell, step):
    case = refine(read("examples/two-discs.json"), cell, step)
    case["post_processing"] = {"output_dt": 0.5, "history_dt": 0.025}
    return {"discs": case}


def measure(runs):
    history = runs["discs"].history
    first, last = history.iloc[0], history.iloc[-1]
    one = first.mass / 2 * 0.1 * np.sqrt(2)
    momentum = np.hypot(history.momentum_x, history.momentum_y).max()
    return [
        Number("largest momentum of both", momentum, 0, "kg m/s", one),
        Number("energy after the collision over that before", (last.kinetic + last.internal) / first.kinetic, 1),
        Number("largest balance of energy over the same", np.abs(history.balance).max() / first.kinetic, 0, "", 1),
    ]


def draw(axes, results):
    history = results[FIRST]["discs"].history
    axes.plot(history.time, history.kinetic, lw=1, label="kinetic")
    axes.plot(history.time, history.internal, lw=1, label="strain")
    axes.plot(history.time, history.kinetic + history.internal, lw=1, color="black", label="sum")
    finish(axes, "time [s]", "energy [J]")
