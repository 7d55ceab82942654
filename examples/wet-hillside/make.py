#!/usr/bin/env python3
"""Makes the maps of examples/wet-hillside.json: a hillside of 25 degrees that runs out into a valley, with a
hollow in its middle, and the colluvium on it, which is thickest in the hollow.

    make.py [FOLDER] [--cell 2]   ground.asc and colluvium.asc; cells in metres
"""
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from maps import make_maps

LENGTH, WIDTH = 64.0, 24.0  # [m]; x runs down the slope
FOOT, SLOPE = 46.0, math.tan(math.radians(25))
MIDDLE, BREADTH = 12.0, 6.0  # of the hollow [m]


def hollow(y):
    return math.exp(-((y - MIDDLE) / BREADTH) ** 2)


def ground(x, y):
    bend = 4.0
    return 10 + SLOPE * bend * math.log1p(math.exp((FOOT - x) / bend)) - 0.8 * hollow(y)


def colluvium(x, y):
    return 3 + 2 * hollow(y)


if __name__ == "__main__":
    make_maps(__file__, __doc__, 2, (LENGTH, WIDTH), {"ground": ground, "colluvium": colluvium}, digits=3)
