"""The factor of safety of an infinite slope, by strength reduction."""
import csv
import os
import pathlib
import subprocess

import numpy as np

from . import ROOT, Number, finish, read, refine

TITLE = "Infinite slope"
SHORT = "the factor of safety, by `lahar safety`"
CHECKS = """A layer of soil, 2 m thick, lies on a plane of 25 degrees. `lahar safety` divides the strength by factors
until equilibrium ends. The ends of the layer hardly count, because it is 150 times as long as thick."""
REFERENCE = """F = tan(phi) / tan(b) + c / (rho g H sin(b)) for soil that dilates by its angle of friction. The number
is the middle of the last bracket, which is 1 % wide."""
FIGURE = "displacements of the trials; soil fails right of the line"
SAYS = "Factors fall with the cell across the layer."
TOLERANCE = 0.02
PHI, ANGLE, COHESION, DENSITY, HEIGHT = np.radians(20), np.radians(25), 7500.0, 2000.0, 2.0
FACTOR = np.tan(PHI) / np.tan(ANGLE) + COHESION / (DENSITY * 10 * HEIGHT * np.sin(ANGLE))


def scenarios(cell, step):
    case = read("tests/verification/safety/infinite-slope.json")
    case["mesh"]["structured"] = {"cell_size": [4, 0.25], "extent": [300, 2.5]}
    for end in case["sets"]["nodes"]["ends"]["union"]:
        end["half_space"]["point"] = [300 if end["half_space"]["normal"][0] < 0 else 0, 0]
    case["particles"][0]["generator"]["region"]["box"]["max"] = [300, HEIGHT]
    case["materials"][0]["youngs_modulus"] = 1e8
    case = refine(case, cell, step)
    case["mesh"]["structured"]["cell_size"][0] = 4  # across the layer alone
    case["analysis"]["time_step"] = {"safety": 0.2 * step / cell}
    return {"slope": case}


class Trials:
    """The trials of `lahar safety`."""

    def __init__(self, folder):
        with open(folder / "safety.csv", encoding="utf-8") as file:
            rows = sorted((float(row["factor"]), row["stable"] == "1", float(row["displacement [m]"]))
                          for row in csv.DictReader(file))
        self.factor, self.stable, self.displacement = map(np.array, zip(*rows))

    @property
    def middle(self):
        return (self.factor[self.stable].max() + self.factor[~self.stable].min()) / 2


def execute(scenario, folder, threads):
    file = folder.with_suffix(".json")
    scenario.write(file)
    program = os.environ.get("LAHAR_PROGRAM") or ROOT / "build" / "release" / "lahar"
    subprocess.run([program, "safety", file, "--quiet", "--tolerance", "0.01", "-o", folder,
                    *([] if threads is None else ["--threads", str(threads)])],
                   check=True, stdout=subprocess.DEVNULL)
    return Trials(pathlib.Path(folder))


def measure(runs):
    return [Number("factor of safety", runs["slope"].middle, FACTOR)]


def draw(axes, results):
    trials = results["(dt, h)"]["slope"]
    for stable, label, colour in ((True, "comes to rest", "tab:blue"), (False, "fails", "tab:red")):
        kind = trials.stable == stable
        axes.semilogy(trials.factor[kind], trials.displacement[kind], "o", ms=5, color=colour, label=label)
    axes.axvline(FACTOR, color="black", lw=1, label="theory")
    finish(axes, "factor by which the strength is divided", "largest displacement [m]")
