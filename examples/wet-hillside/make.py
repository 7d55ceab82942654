#!/usr/bin/env python3
"""Makes the maps of examples/wet-hillside.json: a hillside of 25 degrees that runs out into a valley, with a
hollow in its middle, and the colluvium on it, which is thickest in the hollow.

    make.py [FOLDER] [--cell 2]   ground.asc and colluvium.asc; cells in metres
"""
import argparse
import math
import pathlib

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


def write_grid(file, cell, height):
    """An ESRI ASCII grid; the first row is in the north."""
    columns, rows = round(LENGTH / cell), round(WIDTH / cell)
    with open(file, "w", encoding="ascii") as out:
        out.write(f"ncols {columns}\nnrows {rows}\nxllcorner 0\nyllcorner 0\ncellsize {cell}\n"
                  "NODATA_value -9999\n")
        for row in range(rows):
            y = (rows - row - 0.5) * cell
            out.write(" ".join(f"{height((i + 0.5) * cell, y):.3f}" for i in range(columns)) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=pathlib.Path,
                        default=pathlib.Path(__file__).resolve().parent)
    parser.add_argument("--cell", type=float, default=2.0, help="size of cells [m]; default 2")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    write_grid(arguments.folder / "ground.asc", arguments.cell, ground)
    write_grid(arguments.folder / "colluvium.asc", arguments.cell, colluvium)


if __name__ == "__main__":
    main()
