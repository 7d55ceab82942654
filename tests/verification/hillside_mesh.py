#!/usr/bin/env python3
"""The landslide of examples/landslide.json on a mesh of hexahedra that follow the ground, for measurements.

    hillside_mesh.py FOLDER [--cell 2]    mesh, sets and scenario; --cell 2 has 1.0 million particles,
                                          --cell 4 an eighth of that

The hill is that of examples/landslide/make.py. Where the soil touches the ground it sticks.
"""
import argparse
import json
import pathlib
import sys

try:
    import numpy as np
except ImportError as missing:
    print(missing)
    sys.exit(77)

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples" / "landslide"))
from make import LENGTH, WIDTH, bed, soil_depth

LAYERS_HIGH = 28.0            # the mesh reaches so far above the ground [m]


def write_rows(file, rows, form):
    np.savetxt(file, rows, fmt=form)


def make(folder, cell):
    nx, ny = round(LENGTH / cell), round(WIDTH / cell)
    thick = cell / 2
    nz = round(LAYERS_HIGH / thick)
    x, y = np.meshgrid(np.arange(nx + 1) * cell, np.arange(ny + 1) * cell, indexing="ij")
    base = bed(x, y)

    # Node (i, j, k) has number i + (nx + 1) (j + (ny + 1) k).
    z = base[:, :, None] + np.arange(nz + 1) * thick
    nodes = np.stack([np.broadcast_to(x[:, :, None], z.shape),
                      np.broadcast_to(y[:, :, None], z.shape), z], axis=-1)
    nodes = nodes.transpose(2, 1, 0, 3).reshape(-1, 3)
    number = np.arange(len(nodes)).reshape(nz + 1, ny + 1, nx + 1)

    def corner(di, dj, dk):
        return number[dk:nz + dk, dj:ny + dj, di:nx + di].ravel()

    cells = np.stack([corner(0, 0, 0), corner(1, 0, 0), corner(1, 1, 0), corner(0, 1, 0),
                      corner(0, 0, 1), corner(1, 0, 1), corner(1, 1, 1), corner(0, 1, 1)], axis=-1)

    centre_x = (np.arange(nx) + 0.5) * cell
    centre_y = (np.arange(ny) + 0.5) * cell
    cx, cy = np.meshgrid(centre_x, centre_y, indexing="ij")
    depth = soil_depth(cx, cy).T
    layer_middle = (np.arange(nz) + 0.5) * thick
    filled = np.flatnonzero((layer_middle[:, None, None] < depth[None]).ravel())

    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "mesh.txt", "w") as file:
        file.write(f"{len(nodes)} {len(cells)}\n")
        write_rows(file, nodes, "%.10g")
        write_rows(file, cells, "%d")
    sides = {
        "sides x": np.concatenate([number[:, :, 0].ravel(), number[:, :, -1].ravel()]),
        "sides y": np.concatenate([number[:, 0, :].ravel(), number[:, -1, :].ravel()]),
        "ground": number[0].ravel(),
    }
    sets = {"node_sets": [{"id": i, "set": ids.tolist()} for i, ids in enumerate(sides.values())],
            "cell_sets": [{"id": 0, "set": filled.tolist()}]}
    (folder / "entity_sets.json").write_text(json.dumps(sets))

    scenario = {
        "title": f"Landslide, {len(filled) * 8:,} particles",
        "mesh": {
            "mesh": "mesh.txt", "entity_sets": "entity_sets.json", "cell_type": "ED3H8",
            "isoparametric": True,
            "boundary_conditions": {"velocity_constraints":
                                    [{"nset_id": 0, "dir": 0, "velocity": 0.0},
                                     {"nset_id": 1, "dir": 1, "velocity": 0.0}] +
                                    [{"nset_id": 2, "dir": d, "velocity": 0.0} for d in range(3)]}},
        "particles": [{"generator": {"type": "gauss", "cset_id": 0, "nparticles_per_dir": 2,
                                     "material_id": 0}}],
        "materials": [{"id": 0, "name": "soil", "type": "MohrCoulomb3D", "density": 1900,
                       "youngs_modulus": 2e7, "poisson_ratio": 0.3,
                       "friction": 24, "dilation": 0, "cohesion": 2000, "tension_cutoff": 0}],
        "external_loading_conditions": {"gravity": [0, 0, -9.81]},
        "analysis": {"end_time": 20.0, "locate_particles": False},
        "post_processing": {"output_steps": 1000},
    }
    (folder / "landslide.json").write_text(json.dumps(scenario, indent=2) + "\n")
    print(f"{folder}: {len(cells):,} cells, {len(nodes):,} nodes, {len(filled) * 8:,} particles")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--cell", type=float, default=2.0, help="horizontal size of a cell [m]")
    arguments = parser.parse_args()
    if not 0.5 <= arguments.cell <= 12:
        sys.exit("hillside_mesh.py: --cell must be from 0.5 to 12 [m]")
    make(arguments.folder, arguments.cell)


if __name__ == "__main__":
    main()
