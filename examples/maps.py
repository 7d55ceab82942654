"""What the make.py of the examples with maps share: the command, and ESRI ASCII grids."""
import argparse
import pathlib


def make_maps(script, description, cell, size, heights, origin=(0, 0), digits=2):
    """Writes the maps that the command line of a make.py asks for, and returns their folder.

    script and description are __file__ and __doc__ of the make.py, cell is the default size of cells
    [m], size are the length and width of the maps [m]. heights has by the names of maps functions
    of x and y [m]; there (0, 0) is the corner of the maps, which stands at origin.
    """
    parser = argparse.ArgumentParser(description=description,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=pathlib.Path,
                        default=pathlib.Path(script).resolve().parent)
    parser.add_argument("--cell", type=float, default=cell,
                        help=f"size of cells [m]; default {cell:g}")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for name, height in heights.items():
        write_grid(arguments.folder / f"{name}.asc", arguments.cell, size, height, origin, digits)
    return arguments.folder


def write_grid(file, cell, size, height, origin, digits):
    """An ESRI ASCII grid of heights; the first row is in the north."""
    columns, rows = (round(length / cell) for length in size)
    with open(file, "w", encoding="ascii") as out:
        out.write(f"ncols {columns}\nnrows {rows}\nxllcorner {origin[0]}\nyllcorner {origin[1]}\n"
                  f"cellsize {cell:g}\nNODATA_value -9999\n")
        for row in reversed(range(rows)):
            y = (row + 0.5) * cell
            out.write(" ".join(f"{height((i + 0.5) * cell, y):.{digits}f}" for i in range(columns)))
            out.write("\n")
