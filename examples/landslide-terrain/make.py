#!/usr/bin/env python3
"""Makes the maps of examples/landslide-terrain.json: a made-up hillside as an elevation raster, how
thick the soil is that will slide, and its outline. Other maps take their place by their names.

    make.py [FOLDER] [--cell 4]   ground.asc, thickness.asc and release.geojson; cells in metres
"""
import json
import math
import pathlib
import random
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from maps import make_maps

ORIGIN = (652000.0, 5163000.0)  # of the map [m]
LENGTH, WIDTH = 480.0, 240.0    # [m]; x runs down the slope
FOOT, SLOPE = 260.0, math.tan(math.radians(32))
BOWL = (120.0, 120.0, 70.0, 48.0)  # centre and half axes of what slides [m]
DEEPEST = 16.0                     # [m]


def waves():
    """Spurs and gullies: waves of random directions, the longer the higher."""
    chance = random.Random(7)
    for number in range(1, 9):
        for _ in range(3):
            angle, phase = chance.uniform(0, 2 * math.pi), chance.uniform(0, 2 * math.pi)
            k = 2 * math.pi * number / LENGTH
            yield k * math.cos(angle), k * math.sin(angle), phase, 2.4 / number


WAVES = list(waves())


def ground(x, y):
    bend = 25.0
    slope = SLOPE * bend * math.log1p(math.exp((FOOT - x) / bend))
    return 20 + slope + sum(a * math.sin(kx * x + ky * y + p) for kx, ky, p, a in WAVES)


def thickness(x, y):
    far = ((x - BOWL[0]) / BOWL[2]) ** 2 + ((y - BOWL[1]) / BOWL[3]) ** 2
    return DEEPEST * max(0.0, 1 - far)


def write_outline(file, corners=72):
    turn = [2 * math.pi * i / corners for i in range(corners)] + [0.0]
    ring = [[round(ORIGIN[0] + BOWL[0] + BOWL[2] * math.cos(t), 2),
             round(ORIGIN[1] + BOWL[1] + BOWL[3] * math.sin(t), 2)] for t in turn]
    feature = {"type": "Feature", "properties": {"name": "bowl"},
               "geometry": {"type": "Polygon", "coordinates": [ring]}}
    with open(file, "w", encoding="ascii") as out:
        json.dump({"type": "FeatureCollection", "crs": None, "features": [feature]}, out)
        out.write("\n")


if __name__ == "__main__":
    folder = make_maps(__file__, __doc__, 4, (LENGTH, WIDTH), {"ground": ground, "thickness": thickness},
                       ORIGIN)
    write_outline(folder / "release.geojson")
