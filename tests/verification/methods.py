#!/usr/bin/env python3
"""Tabulates what shape functions and velocity transfers do with four kinds of material.

    tests/verification/methods.py [--lahar PROGRAM] [--threads N] [--only NAME] [FOLDER]

Runs sand, water, clay and an elastic bar with every method, at the default step and at half of it, into FOLDER
(default: build/methods), and prints a table in Markdown. It takes some ten minutes. Runs that are there already are
not made again.
"""
import argparse
import csv
import json
import math
import pathlib
import subprocess

import h5py
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]


def half_space(point, normal):
    return {"half_space": {"point": point, "normal": normal}}


def held(nset, *directions):
    return [{"nset": nset, "dir": d, "velocity": 0} for d in directions]


def box(low, high):
    return {"box": {"min": low, "max": high}}


def body(material, region, per_cell, **more):
    return {"generator": {"type": "region", "material": material, "region": region, "per_cell": per_cell, **more}}


def tank(width, height):
    """Sets of nodes of a rectangle's sides."""
    return {"floor": half_space([0, 0], [0, 1]), "top": half_space([0, height], [0, -1]),
            "sides": {"union": [half_space([0, 0], [1, 0]), half_space([width, 0], [-1, 0])]}}


def sand():
    """A column of dry sand that collapses on a rough floor."""
    return {
        "mesh": {"structured": {"cell_size": 0.01, "extent": [0.5, 0.16]},
                 "boundary_conditions": {"velocity_constraints": held("middle", "x") + held("floor", "x", "y")}},
        "sets": {"nodes": {"floor": half_space([0, 0], [0, 1]), "middle": half_space([0, 0], [1, 0])}},
        "materials": [{"name": "sand", "type": "MohrCoulomb", "density": 1600, "youngs_modulus": 1e6,
                       "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 0, "tension_cutoff": 0}],
        "particles": [body("sand", box([0, 0], [0.1, 0.1]), 2)],
        "external_loading_conditions": {"gravity": [0, -9.81]},
        "analysis": {"end_time": 0.6}, "post_processing": {"output_dt": 0.6}}


def water():
    """A column of water that sloshes in a closed tank until it is at rest."""
    return {
        "mesh": {"structured": {"cell_size": 0.02, "extent": [0.2, 0.6]},
                 "boundary_conditions": {"velocity_constraints":
                                         held("sides", "x") + held("floor", "y") + held("top", "y")}},
        "sets": {"nodes": tank(0.2, 0.6)},
        "materials": [{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 4e5,
                       "dynamic_viscosity": 1e-3}],
        "particles": [body("water", box([0, 0], [0.1, 0.2]), 3)],
        "external_loading_conditions": {"gravity": [0, -9.81]},
        "analysis": {"end_time": 3}, "post_processing": {"output_dt": 3}}


def clay():
    """A rough plate in contact that is pushed into clay by 8 % of its width; half of it."""
    return {
        "mesh": {"structured": {"cell_size": 0.1, "extent": [5, 4]},
                 "boundary_conditions": {"velocity_constraints": held("floor", "x", "y") + held("sides", "x"),
                                         "particles_velocity_constraints": [
                                             {"pset": "plate", "dir": "x", "velocity": 0},
                                             {"pset": "plate", "dir": "y", "velocity": -0.2}]}},
        "sets": {"nodes": tank(5, 4)},
        "materials": [{"name": "clay", "type": "VonMises", "density": 1800, "youngs_modulus": 1e7,
                       "poisson_ratio": 0.45, "yield_stress": 20000},
                      {"name": "steel", "type": "LinearElastic", "density": 7800, "youngs_modulus": 2e7,
                       "poisson_ratio": 0.2}],
        "particles": [body("clay", box([0, 0], [5, 3]), 2), body("steel", box([0, 3], [0.5, 3.3]), 2, pset="plate")],
        "analysis": {"end_time": 0.4, "interface": True, "contact": {"friction": 1}},
        "post_processing": {"output_dt": 0.4, "history_dt": 0.05}}


def solid():
    """An elastic bar that vibrates along its axis, ten times, while it flies through 30 cells."""
    speed, width = 5.0, 0.025  # of waves [m/s]; of a slice of one particle [m]
    slices = []
    for k in range(40):
        x = 0.2 + k * width
        velocity = [0.375 + 0.1 * math.cos(math.pi * (k + 0.5) * width), 0]
        slices.append(body("bar", box([x, 0], [x + width, 0.2]), 2, velocity=velocity))
    return {
        "mesh": {"structured": {"cell_size": 0.05, "extent": [3, 0.2]},
                 "boundary_conditions": {"velocity_constraints": held("sides", "y")}},
        "sets": {"nodes": {"sides": {"union": [half_space([0, 0], [0, 1]), half_space([0, 0.2], [0, -1])]}}},
        "materials": [{"name": "bar", "type": "LinearElastic", "density": 1000,
                       "youngs_modulus": 1000 * speed**2, "poisson_ratio": 0}],
        "particles": slices,
        "analysis": {"end_time": 4}, "post_processing": {"output_dt": 4}}


def frame(run, last):
    frames = sorted((run / "frames").glob("particles_*.hdf"))
    with h5py.File(frames[-1 if last else 0]) as file:
        data = file["VTKHDF"]
        return data["Points"][:], {name: data["PointData"][name][:] for name in data["PointData"]}


def history(run):
    with open(run / "history.csv") as file:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]


def run_out(run):
    x, _ = frame(run, True)
    return np.quantile(x[:, 0], 0.99) / 0.1 - 1


def depth(run):
    x, _ = frame(run, True)
    return 2 * x[:, 1].mean() / 0.1


def reaction(run):
    rows = history(run)
    a, b = (min(rows, key=lambda row: abs(row["time"] - t)) for t in (0.25, 0.35))
    prandtl = 0.5 * (2 + math.pi) * 20000 / math.sqrt(3)
    return (b["external"] - a["external"]) / (b["time"] - a["time"]) / 0.2 / prandtl


def kept(run):
    """Energy of the vibration, over that at its beginning."""
    rows = history(run)
    flight = 0.5 * rows[0]["mass"] * 0.375**2
    first, last = (row["kinetic"] + row["internal"] - flight for row in (rows[0], rows[-1]))
    return last / first


CASES = {"sand": (sand, run_out, "run-out / L0"), "water": (water, depth, "depth at rest / true"),
         "clay": (clay, reaction, "reaction / Prandtl's"), "solid": (solid, kept, "energy kept")}
TRANSFERS = {"default": {}, "flip": {"velocity_update": "flip"}, "pic": {"velocity_update": "pic"},
             "xpic 2": {"velocity_update": "xpic"},
             "xpic 5": {"velocity_update": "xpic", "velocity_update_settings": {"order": 5}},
             "apic": {"velocity_update": "apic"}, "tpic": {"velocity_update": "tpic"},
             "asflip": {"velocity_update": "asflip"}}
FUNCTIONS = ("element", "gimp", "cpdi", "quadratic_spline", "cubic_spline")
METHODS = [(f, "default") for f in FUNCTIONS] + [("quadratic_spline", t) for t in TRANSFERS if t != "default"]


def result(args, case, functions, transfer, safety):
    make, measure, _ = CASES[case]
    name = f"{case}-{functions}-{transfer.replace(' ', '')}-{safety}"
    run, file = args.folder / name, args.folder / f"{name}.json"
    if not (run / "history.csv").exists():
        scenario = make()
        scenario["analysis"] |= {"shape_functions": functions, "time_step": {"safety": safety}, **TRANSFERS[transfer]}
        file.write_text(json.dumps(scenario))
        with open(args.folder / f"{name}.log", "w") as log:
            done = subprocess.run([args.lahar, "run", file, "-o", run, "--overwrite", "--threads", str(args.threads)],
                                  stdout=log, stderr=subprocess.STDOUT, check=False)
        if run.exists():
            (run / "status").write_text(str(done.returncode))
    status = (run / "status").read_text() if (run / "status").exists() else "refused"
    if status != "0":
        return None, None, "refused" if status in ("2", "refused") else "ended"
    rows = history(run)
    scale = max(max(abs(row["external"]) for row in rows), rows[0]["kinetic"])
    return measure(run), max(abs(row["balance"]) for row in rows) / scale, ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=pathlib.Path, default=ROOT / "build/methods")
    parser.add_argument("--lahar", default=ROOT / "build/release/lahar")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--only", choices=CASES, help="one case")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    cases = [args.only] if args.only else list(CASES)
    print("| functions | transfer | " + " | ".join(f"{c}: {CASES[c][2]} | half step | balance" for c in cases) + " |")
    print("|---|---|" + "---|---|---|" * len(cases))
    for functions, transfer in METHODS:
        cells = []
        for case in cases:
            step = 0.2 if case == "sand" else 0.4  # the defaults
            value, balance, why = result(args, case, functions, transfer, step)
            half, _, why_half = result(args, case, functions, transfer, step / 2)
            change = why_half  # of a number that is hardly above zero says nothing
            if value and half and value > 0.02:
                change = f"{100 * (half / value - 1):+.1f} %"
            cells += [f"{value:.3f}" if value is not None else why, change,
                      f"{100 * balance:.1f} %" if balance is not None else ""]
        print(f"| `{functions}` | {transfer} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
