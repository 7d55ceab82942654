#!/usr/bin/env python3
"""Draw what the cases against experiments computed beside what was measured.

    LAHAR_WORLD_OUTPUT=curves build/release/tests/test_verification_slow -tc="*rods*"
    world_figures.py curves [-o FOLDER]       rods.png, front.png, building.png, ...

The tests write their curves into the folder that LAHAR_WORLD_OUTPUT names, one file per case, cell
and share of the stable step; figures are drawn of those that are there.
"""
import argparse
import pathlib
import re
import sys

try:
    import matplotlib
    import numpy as np

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
except ImportError as missing:
    sys.exit(f"world_figures.py: the Python module '{missing.name}' is missing. On Debian:\n"
             "    apt-get install python3-numpy python3-matplotlib")

DATA = pathlib.Path(__file__).resolve().parent / "world"
GAUGES = {"G1": 1, "G2": 2, "G3": 3, "G4": 4, "G6": 6}  # columns of building-gauges.csv


def table(file):
    return np.loadtxt(file, delimiter=",", ndmin=2)


def computed(folder, case):
    """(label, table) of each run of a case."""
    for file in sorted(folder.glob(f"{case}-cell*.csv")):
        cell, safety = re.fullmatch(r".*-cell(.*)-safety(.*)", file.stem).groups()
        yield f"cell {float(cell) * 1e3:g} mm, {safety} of the stable step", table(file)


def draw(folder, axes, case, **style):
    found = list(computed(folder, case))
    for label, rows in found:
        axes.plot(rows[:, 0], rows[:, 1], label=label, lw=1, **style)
    return bool(found)


def rods(folder):
    figure, axes = plt.subplots(figsize=(8, 3))
    found = draw(folder, axes, "rods-surface")
    axes.set_prop_cycle(None)
    draw(folder, axes, "rods-failure", ls="--")
    for name, marker in (("surface", "o"), ("failure", "^")):
        rows = table(DATA / f"rods-{name}.csv")
        axes.plot(rows[:, 0], rows[:, 1], "k" + marker, ms=3, label=f"Bui et al. 2008: {name}")
    axes.set(xlabel="x [m]", ylabel="y [m]", xlim=(0, 0.5), ylim=(0, 0.11), aspect="equal")
    return figure if found else None


def front(folder):
    figure, axes = plt.subplots(figsize=(6, 4))
    found = draw(folder, axes, "front")
    for name, label, marker in (("martin-moyce-1", "Martin & Moyce 1952, 1.125 in", "o"),
                                ("martin-moyce-2", "Martin & Moyce 1952, 2.25 in", "s"),
                                ("koshizuka-oka", "Koshizuka & Oka 1996", "^"),
                                ("koshizuka-oka-2", "the same, another reading", "v")):
        rows = table(DATA / f"front-{name}.csv")
        axes.plot(rows[:, 0], rows[:, 1], "k" + marker, ms=4, mfc="none", label=label)
    axes.set(xlabel="t sqrt(2 g / a)", ylabel="z / a", xlim=(0, 4), ylim=(1, 5))
    return figure if found else None


def building(folder):
    figure, all_axes = plt.subplots(len(GAUGES), 1, figsize=(7, 9), sharex=True)
    measured, found = table(DATA / "building-gauges.csv"), False
    free = 0.8  # [s] from when water is free to the beginning of the record: so fronts meet at G2
    for (name, column), axes in zip(GAUGES.items(), all_axes):
        found = draw(folder, axes, f"building-{name}") or found
        axes.plot(measured[:, 0] + free, measured[:, column], "k.", ms=4, label="measured")
        axes.set(ylabel=f"{name} [m]", xlim=(0, 3.4))
    all_axes[-1].set_xlabel("t [s]")
    return figure if found else None


def chute(folder):
    figure, axes = plt.subplots(figsize=(6, 4))
    found = draw(folder, axes, "chute-force")
    axes.set(xlabel="t [s]", ylabel="force on the wall / (M g sin)")
    return figure if found else None


def structure(folder):
    figure, axes = plt.subplots(figsize=(6, 4))
    found = draw(folder, axes, "structure-force")
    rows = table(DATA / "structure-force.csv")
    axes.plot(rows[:, 0], rows[:, 1], "k.", label="Yeh and Petroff")
    axes.set(xlabel="t [s]", ylabel="force on the structure [N]")
    return figure if found else None


def ball(folder):
    figure, axes = plt.subplots(figsize=(6, 4))
    found = draw(folder, axes, "ball-0.2")
    axes.axhline(0.0212, color="k", ls=":", label="Uehara et al. 2003: at rest")
    axes.set(xlabel="t [s]", ylabel="depth of the ball [m]")
    return figure if found else None


def columns(folder):
    cases = ["sand-column-1", "sand-column-2", "sand-column-4", "sand-cylinder"]
    figure, all_axes = plt.subplots(len(cases), 1, figsize=(7, 9))
    found = False
    for case, axes in zip(cases, all_axes):
        found = draw(folder, axes, case) or found
        axes.set(ylabel="depth [m]", title=case)
    all_axes[-1].set_xlabel("x or r [m]")
    return figure if found else None


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("curves", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("."))
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    drawn = 0
    for make in (rods, front, building, structure, chute, ball, columns):
        figure = make(options.curves)
        if figure is None:
            continue
        for axes in figure.axes[:1]:
            axes.legend(fontsize=7)
        figure.tight_layout()
        file = options.output / f"{make.__name__}.png"
        figure.savefig(file, dpi=150)
        print(file)
        drawn += 1
    if drawn == 0:
        sys.exit(f"world_figures.py: {options.curves} has no curves. Run test_verification_slow with "
                 f"LAHAR_WORLD_OUTPUT={options.curves}")


if __name__ == "__main__":
    main()
