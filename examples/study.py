#!/usr/bin/env python3
"""How far a column of sand runs out, by its friction angle: twenty runs, which a second call does not repeat.

Needs the Python package: PYTHONPATH=build/release/python python3 examples/study.py
"""
import argparse
from pathlib import Path

import lahar

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--end-time", type=float, default=0.6, help="of each run [s]")
case = lahar.Scenario.read(Path(__file__).with_name("column-collapse.json"))
case["mesh"]["structured"].update(cell_size=[0.01, 0.01], counts=[40, 16])  # coarse: a study of seconds
case["analysis"]["end_time"] = arguments.parse_args().end_time


def runout(run):
    return run.frames[-1].particles["coord_x"].quantile(0.99) / 0.1 - 1  # without single grains that fly ahead


study = lahar.study("results/study", case, {"materials.0.friction": range(16, 36)})
table = study.table(runout=runout)
print(table.to_string())
axes = table.plot(x="materials.0.friction", y="runout", marker="o", xlabel="friction angle [degrees]",
                  ylabel="(front - width) / width", legend=False)
axes.figure.savefig("results/study.png")
