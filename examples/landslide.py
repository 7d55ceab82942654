#!/usr/bin/env python3
"""A landslide on a hillside: writes the case, and draws what came out of it.

    landslide.py make FOLDER [--cell 2]   mesh, sets and scenario; --cell 2 has 1.0 million particles,
                                          --cell 4 an eighth of that
    landslide.py picture RUN [-o FILE]    the hillside before and after, and depths of the deposit

The hill is made up, but not smooth: a slope of 33 degrees that runs out into a valley, with spurs
and gullies of all sizes (noise of random phases whose amplitudes fall with the wave number, always
the same one). The mesh is made of hexahedra that follow the ground. A bowl in the slope is filled with
soil of a little cohesion that cannot stay where it is; where it touches the ground it sticks.
"""
import argparse
import json
import pathlib
import sys

try:
    import numpy as np
except ImportError as missing:
    sys.exit(f"landslide.py: the Python module '{missing.name}' is missing. On Debian:\n"
             "    apt-get install python3-numpy python3-h5py python3-matplotlib")

LENGTH, WIDTH = 480.0, 240.0  # of the hillside [m]; x runs down the slope
LAYERS_HIGH = 28.0            # the mesh reaches so far above the ground [m]
SLOPE = np.tan(np.radians(33))
FOOT = 250.0                  # where the slope ends [m]
DEEPEST = 26.0                # of the soil in the bowl [m]
BOWL = (122.0, 120.0, 105.0, 84.0)  # centre and half axes [m]


def ground(x, y):
    """Height of the ground [m]: a slope that bends smoothly into the valley, spurs and gullies."""
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


def write_rows(file, rows, form):
    np.savetxt(file, rows, fmt=form)


def make(folder, cell):
    nx, ny = round(LENGTH / cell), round(WIDTH / cell)
    thick = cell / 2
    nz = round(LAYERS_HIGH / thick)
    x, y = np.meshgrid(np.arange(nx + 1) * cell, np.arange(ny + 1) * cell, indexing="ij")
    base = ground(x, y)

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

    E, nu, density = 2e7, 0.3, 1900.0
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
        "materials": [{"id": 0, "name": "soil", "type": "MohrCoulomb3D", "density": density,
                       "youngs_modulus": E, "poisson_ratio": nu,
                       "friction": 24, "dilation": 0, "cohesion": 2000, "tension_cutoff": 0,
                       "softening": False, "residual_friction": 24, "residual_dilation": 0,
                       "residual_cohesion": 2000, "peak_pdstrain": 0, "residual_pdstrain": 0}],
        "external_loading_conditions": {"gravity": [0, 0, -9.81]},
        "analysis": {"end_time": 20.0, "locate_particles": False},
        "post_processing": {"output_steps": 1000},
    }
    (folder / "landslide.json").write_text(json.dumps(scenario, indent=2) + "\n")
    print(f"{folder}: {len(cells):,} cells, {len(nodes):,} nodes, {len(filled) * 8:,} particles")


def read_frame(path):
    import h5py

    with h5py.File(path, "r") as file:
        data = file["VTKHDF/PointData"]
        order = np.argsort(data["id"][:])
        return (file["VTKHDF/Points"][:][order], data["displacement"][:][order],
                data["velocity"][:][order], float(file["VTKHDF/FieldData/time"][0]))


def picture(run, output):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.colors import LightSource

    frames = sorted((run / "frames").glob("particles_*.hdf"))
    if not frames:
        sys.exit(f"landslide.py: no frames in {run}; run the case first")
    points, moved, velocity, time = read_frame(frames[-1])

    grid = 2.0
    x, y = np.meshgrid(np.arange(0, LENGTH, grid) + grid / 2, np.arange(0, WIDTH, grid) + grid / 2,
                       indexing="ij")
    base = ground(x, y)

    def depth(at):
        """Depth of the soil above the ground [m]: the highest particle of each column."""
        i = np.clip((at[:, 0] / grid).astype(int), 0, x.shape[0] - 1)
        j = np.clip((at[:, 1] / grid).astype(int), 0, x.shape[1] - 1)
        top = np.full(x.shape, -np.inf)
        np.maximum.at(top, (i, j), at[:, 2])
        return np.where(np.isfinite(top), np.maximum(top - base, 0), 0)

    light = LightSource(azdeg=315, altdeg=40)
    fig, axes = plt.subplots(3, 1, figsize=(8, 9.5), dpi=90, layout="constrained",
                             height_ratios=(1, 1, 0.7))
    for axis, at, title in ((axes[0], points - moved, "before"), (axes[1], points, f"after {time:.0f} s")):
        d = depth(at)
        axis.imshow(light.hillshade((base + d).T, dx=grid, dy=grid), cmap="gray", origin="lower",
                    extent=(0, LENGTH, 0, WIDTH), vmin=-0.2, vmax=1.1)
        image = axis.imshow(np.ma.masked_less(d.T, 0.3), cmap="YlOrBr", origin="lower", alpha=0.75,
                            extent=(0, LENGTH, 0, WIDTH), vmin=0, vmax=DEEPEST)
        axis.contour(x, y, base, levels=np.arange(0, 250, 10), colors="k", linewidths=0.3)
        axis.set(title=f"Depth of the soil [m], {title}", xlabel="x [m]", ylabel="y [m]")
        fig.colorbar(image, ax=axis, shrink=0.8)
    middle = np.abs(points[:, 1] - WIDTH / 2) < grid
    line = np.linspace(0, LENGTH, 400)
    axes[2].plot(line, ground(line, np.full_like(line, WIDTH / 2)), "k", lw=1)
    before = points - moved
    start = np.abs(before[:, 1] - WIDTH / 2) < grid
    axes[2].plot(before[start, 0], before[start, 2], ",", color="0.75")
    dots = axes[2].scatter(points[middle, 0], points[middle, 2], s=1.2, lw=0, zorder=3,
                           c=np.linalg.norm(moved[middle], axis=1), cmap="viridis")
    axes[2].set(title="Section along the middle, before (grey) and after", xlabel="x [m]",
                ylabel="z [m]", aspect="equal")
    fig.colorbar(dots, ax=axes[2], shrink=0.8, label="displacement [m]")
    fig.savefig(output)
    speed = np.linalg.norm(velocity, axis=1)
    print(f"{output}: after {time:.1f} s the soil has moved {np.linalg.norm(moved, axis=1).mean():.0f} m "
          f"on average, at most {np.linalg.norm(moved, axis=1).max():.0f} m; mean speed "
          f"{speed.mean():.2f} m/s")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    command = commands.add_parser("make", help="write mesh, sets and scenario")
    command.add_argument("folder", type=pathlib.Path)
    command.add_argument("--cell", type=float, default=2.0, help="horizontal size of a cell [m]")
    command = commands.add_parser("picture", help="draw the last frame of a run")
    command.add_argument("run", type=pathlib.Path)
    command.add_argument("-o", "--output", type=pathlib.Path)
    arguments = parser.parse_args()
    if arguments.command == "make":
        if not 0.5 <= arguments.cell <= 12:
            sys.exit("landslide.py: --cell must be from 0.5 to 12 [m]")
        make(arguments.folder, arguments.cell)
    else:
        picture(arguments.run, arguments.output or arguments.run / "landslide.png")


if __name__ == "__main__":
    main()
