#!/usr/bin/env python3
"""Makes the maps of examples/landslide.json: the bed of a made-up hillside, and the depth of the soil on
it. The slope of 33 degrees runs out into a valley. It has spurs and gullies of all sizes. A bowl in the
slope is full of soil.

    make.py [FOLDER] [--cell 4]   bed.asc and soil.asc; cells in metres
"""
import pathlib
import sys

try:
    import numpy as np
except ImportError:
    sys.exit("make.py: the Python module 'numpy' is missing. On Debian:\n"
             "    apt-get install python3-numpy\n"
             "and run this script with /usr/bin/python3.")

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from maps import make_maps

LENGTH, WIDTH = 480.0, 240.0        # of the hillside [m]; x runs down the slope
SLOPE = np.tan(np.radians(33))
FOOT = 250.0                        # where the slope ends [m]
DEEPEST = 26.0                      # of the soil in the bowl [m]
BOWL = (122.0, 120.0, 105.0, 84.0)  # centre and half axes [m]


def bed(x, y):
    """Height of the ground below the soil [m]."""
    bend = 30.0
    slope = SLOPE * bend * np.logaddexp(0.0, (FOOT - x) / bend)
    random = np.random.default_rng(7)
    rough = np.zeros_like(x)
    for wave in range(1, 13):
        for _ in range(3):
            angle, phase = random.uniform(0, 2 * np.pi, 2)
            k = 2 * np.pi * wave / LENGTH
            rough += 6.0 / wave**1.4 * np.sin(k * (x * np.cos(angle) + y * np.sin(angle)) + phase)
    channel = 14.0 * ((y - WIDTH / 2) / (WIDTH / 2))**2  # the valley gathers what comes down
    return slope + rough * 0.5 + channel


def soil_depth(x, y):
    """Depth of the soil that will slide [m]; zero outside of the bowl."""
    cx, cy, ax, ay = BOWL
    r2 = ((x - cx) / ax)**2 + ((y - cy) / ay)**2
    return DEEPEST * np.clip(1 - r2, 0, None)**0.5


if __name__ == "__main__":
    make_maps(__file__, __doc__, 4, (LENGTH, WIDTH), {"bed": bed, "soil": soil_depth})
