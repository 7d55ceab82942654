#!/usr/bin/env python3
"""VTK's own readers, which are ParaView's, find in results of runs what `lahar export --to csv` writes.

    vtk_test.py LAHAR

Two materials are run in three dimensions and in two, and with frames in single precision. The last frame and its .vtu
export are opened with VTK: points, ids and every component of every column are those of the CSV file. Its digits tell
each number, so that all are compared to the last bit. Exit status 77: VTK for Python is missing; where CI=true, 1.
"""
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True  # beside the sources
from check_vtkhdf import arrays, compare, numpy, points, read_frame, read_vtu, same  # noqa: E402  (leaves without VTK)

SUFFIXES = {1: ("",), 3: ("_x", "_y", "_z"), 6: ("_xx", "_yy", "_zz", "_xy", "_yz", "_xz")}
#: Columns that a run has to show here, beside what all have: derived ones, and states of both materials.
ASKED = ["speed", "deviatoric_stress", "principal_stress_1"]
STATES = ["pdstrain", "pressure"]


def case(dim, precision, functions):
    """A heap of sand beside water, both pushed aside."""
    def corner(*x):
        return list(x[3 - dim:])
    return {
        "mesh": {"structured": {"cell_size": 0.1, "extent": corner(0.4, 0.8, 0.6)},
                 "boundary_conditions": {"walls": [{"nset": "floor", "normal": corner(0, 0, 1)}]}},
        "sets": {"nodes": {"floor": {"half_space": {"point": corner(0, 0, 0), "normal": corner(0, 0, 1)}}}},
        "materials": [
            {"name": "sand", "type": "MohrCoulomb", "density": 1700, "youngs_modulus": 1e6, "poisson_ratio": 0.3,
             "friction": 30, "dilation": 0, "cohesion": 100, "tension_cutoff": 0},
            {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e5, "dynamic_viscosity": 1e-3}],
        "particles": [
            {"generator": {"type": "region", "per_cell": 2, "material": name,
                           "region": {"box": {"min": corner(0.1, left, 0), "max": corner(0.3, right, top)}}}}
            for name, left, right, top in (("sand", 0.1, 0.4, 0.4), ("water", 0.4, 0.6, 0.2))],
        "external_loading_conditions": {"gravity": corner(0.2, 0.5, -9.81)},
        "analysis": {"nsteps": 60, "shape_functions": functions},
        "post_processing": {"output_steps": 60, "frame_precision": precision,
                            "vtk": ["velocity", "displacement", "stress", "strain", *ASKED]},
    }


def table(path):
    """Columns of a CSV file; ids and materials are whole numbers."""
    with open(path, newline="") as file:
        head, *rows = csv.reader(file)
    return {name: numpy.array(column, dtype=numpy.int64 if name in ("id", "material") else numpy.float64)
            for name, column in zip(head, zip(*rows))}


def call(*command):
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"


def check(grid, expected, what):
    """Whether a grid has the columns of a table, whatever the order of its particles."""
    order = numpy.argsort(arrays(grid.GetPointData())["id"])
    shown = {"coord": points(grid), **arrays(grid.GetPointData())}
    compared = set()
    for name, values in shown.items():
        values = values[order].reshape(len(order), -1)
        count = values.shape[1]
        for component, suffix in enumerate(SUFFIXES.get(count, [f"_{k}" for k in range(count)])):
            column = name + suffix
            if column in expected:
                assert same(values[:, component], expected[column]), f"{what}: {column} is not that of the CSV file"
                compared.add(column)
            else:  # across the plane
                assert count in (3, 6) and not values[:, component].any(), f"{what}: {column} is not in the CSV file"
    # States have a number beside their name.
    again = {name for name in expected if name.startswith("svars_")}
    for name in again:
        assert any(same(expected[other], expected[name]) for other in compared), f"{name} is no column of its own"
    missing = expected.keys() - compared - again
    assert not missing, f"{what} lacks {sorted(missing)}"
    return compared


def main(lahar):
    with tempfile.TemporaryDirectory() as place:
        for name, dim, precision, functions in (("space", 3, "double", "gimp"), ("plane", 2, "double", "cpdi"),
                                                ("single", 3, "single", "element")):
            folder = Path(place) / name
            (Path(place) / "case.json").write_text(json.dumps(case(dim, precision, functions)))
            call(lahar, "run", Path(place) / "case.json", "-q", "-t", "2", "-o", folder)
            for kind in ("csv", "vtu"):
                call(lahar, "export", folder, "--to", kind)
            frame, file = max(folder.glob("frames/*.hdf")), max(folder.glob("export/*.vtu"))
            expected = table(file.with_suffix(".csv"))
            a, b = read_frame(frame), read_vtu(file)
            compare(a, b)
            columns = check(a, expected, frame.name)
            assert check(b, expected, file.name) == columns
            # The run has to have something to compare.
            assert set(expected["material"]) == {0, 1} and columns >= {*ASKED[::2], *STATES, "coord_x", "stress_xy"}
            still = [column for column in ("velocity_x", "displacement_y", "stress_xy", "strain_xx", "pressure",
                                           "deviatoric_stress_zz") if not expected[column].any()]
            assert not still, f"{name}: nothing but zeros in {still}"
            print(f"{name}: {len(columns)} columns of {len(expected['id'])} particles are equal in frame, .vtu, .csv")


if __name__ == "__main__":
    main(*sys.argv[1:])
