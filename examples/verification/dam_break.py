"""The front of a collapsing column of water."""
import numpy as np

from . import GRAVITY, ROOT, Number, finish, read, refine

TITLE = "Dam break"
SHORT = "the front of water on a dry floor"
CHECKS = """A column of water twice as high as wide collapses in a tank (tests/verification/world/water-column.json).
The front is where columns of depth, connected with the source, become thinner than half a cell of the first mesh."""
REFERENCE = """Measured by Martin and Moyce (1952), base a = 2.25 inches: Z = z / a over T = t sqrt(2 g / a). When the
water of the experiment was free was not observed, so the clock starts where they first saw the front."""
FIGURE = "front over time: Martin and Moyce (points) and two cells (lines)"
SAYS = """The front is ahead at the last point that the run reaches, and the speed is mostly the error of that
point."""
TOLERANCE = 0.02  # flows part where other vector widths round
BASE, DENSITY = 0.05716, 1000.0
WIDTH = BASE / 20
UNIT = np.sqrt(BASE / 2 / GRAVITY)  # t over T [s]


def scenarios(cell, step):
    case = refine(read("tests/verification/world/water-column.json"), cell, step)
    case["post_processing"] = {"output_dt": 0.05 * UNIT, "history_dt": 0.01}
    return {"column": case}


def published():
    return np.loadtxt(ROOT / "tests/verification/world/front-martin-moyce-2.csv", delimiter=",").T


def front(run):
    """T and Z, from the depths of columns by mass."""
    T, Z = [], []
    for frame in run.frames:
        column = np.floor(frame["coordinates"][:, 0] / WIDTH).astype(int)
        depth = np.append(np.bincount(column, weights=frame["mass"]) / (DENSITY * WIDTH), 0.0)
        i = int(np.argmax(depth <= WIDTH / 2))
        share = (depth[i - 1] - WIDTH / 2) / (depth[i - 1] - depth[i])
        T.append(frame.time / UNIT)
        Z.append((i - 0.5 + share) * WIDTH / BASE)
    return np.array(T), np.array(Z)


def reached(T, Z, place):
    """The first T at which the front reaches a place."""
    i = int(np.argmax(Z >= place))
    return T[i - 1] + (place - Z[i - 1]) / (Z[i] - Z[i - 1]) * (T[i] - T[i - 1])


def measure(runs):
    T, Z = front(runs["column"])
    at, place = published()
    late = at[0] - reached(T, Z, place[0])
    seen = at - late <= T[-1]
    errors = np.interp(at[seen] - late, T, Z) / place[seen] - 1
    speeds = [np.polyfit(at[seen][1:], z, 1)[0] for z in (np.interp(at[seen] - late, T, Z)[1:], place[seen][1:])]
    return [
        Number("largest deviation of Z, share of Z", np.abs(errors).max(), 0, "", 1),
        Number("speed of the front, dZ/dT, by a line through points 2 to the last", *speeds),
    ]


def draw(axes, results):
    at, place = published()
    axes.plot(at, place, "o", ms=4, color="black", label="Martin and Moyce")
    for name, label in (("(dt, h)", "a / 20"), ("(dt/2, h/2)", "a / 40")):
        T, Z = front(results[name]["column"])
        axes.plot(T + at[0] - reached(T, Z, place[0]), Z, lw=1, label=f"cells of {label}")
    axes.set_xlim(0, 4.6)
    axes.set_ylim(0.8, 6.2)
    finish(axes, "T", "Z")
