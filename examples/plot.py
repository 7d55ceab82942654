#!/usr/bin/env python3
"""Draw a run of Lahar.

    plot.py RUN                               speed of the particles in the last frame
    plot.py RUN --field stress_xx --step 100  another field and step
    plot.py RUN --field stress_xx --normalise 100   divided by a reference value
    plot.py RUN --history                     energies over time

RUN is a run folder or one frame (.hdf). Fields: any array of the frame (a vector stands for its
length), one component of it (velocity_x, stress_xy), and speed, stress_mean, stress_mises.
A 3D state is drawn as the layer of particles next to a plane; --slice chooses it. With --slice top it is
seen from above.
"""
import argparse
import json
import pathlib
import sys

try:
    import h5py
    import matplotlib
    import numpy as np

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection
    from mpl_toolkits.axes_grid1 import make_axes_locatable
except ImportError as missing:
    sys.exit(f"plot.py: the Python module '{missing.name}' is missing. On Debian:\n"
             "    apt-get install python3-numpy python3-h5py python3-matplotlib\n"
             "and run this script with /usr/bin/python3.")

AXES = "xyz"
TENSOR = ["xx", "yy", "zz", "xy", "yz", "xz"]
# Particles are drawn as squares of their volume, on top of larger ones that keep the background from
# shining through where a body is stretched or its particles are further apart in one direction.
UNDERLAY = 1.5
DOTS_PER_INCH = 150


class PlotError(Exception):
    """Something the user can mend."""


class State:
    """One frame: `arrays` by name, `x` (particles, dim), `volume`, `step`, `time`, `title`."""

    def __init__(self, path, title=""):
        try:
            with h5py.File(path, "r") as file:
                grid = file["VTKHDF"]
                self.dim = int(file["lahar"].attrs["dim"][0])
                self.x = grid["Points"][:, :self.dim]
                self.step = int(grid["FieldData/step"][0])
                self.time = float(grid["FieldData/time"][0])
                self.arrays = {name: data[()] for name, data in grid["PointData"].items()}
                self.units = {name: text(data.attrs.get("unit", ""))
                              for name, data in grid["PointData"].items()}
            order = np.argsort(self.arrays["id"])  # frames have the order of the patches
            self.x = self.x[order]
            self.arrays = {name: values[order] for name, values in self.arrays.items()}
        except OSError as error:
            raise PlotError(f"cannot read {path}: {error}") from None
        except KeyError:
            raise PlotError(f"{path} is no frame of Lahar") from None
        if len(self.x) == 0:
            raise PlotError(f"{path} has no particles")
        self.title = title
        self.path = pathlib.Path(path)

    def names(self):
        names = ["speed", "stress_mean", "stress_mises"]
        for name, values in self.arrays.items():
            names.append(name)
            if values.ndim == 2:
                suffixes = TENSOR if values.shape[1] == 6 else AXES[:self.dim]
                names += [f"{name}_{suffix}" for suffix in suffixes]
        return names

    def field(self, name):
        """Values of a field, its unit and its name as a person reads it."""
        if name == "speed":
            return np.linalg.norm(self.array("velocity"), axis=1), "m/s", "speed"
        if name == "stress_mean":
            return self.array("stress")[:, :3].mean(axis=1), "Pa", "mean stress"
        if name == "stress_mises":
            return von_mises(self.array("stress")), "Pa", "von Mises stress"
        if name in self.arrays:
            values, unit = self.arrays[name], self.units[name]
            if values.ndim == 2 and values.shape[1] == 6:
                raise PlotError(f"{name} is a tensor; choose one of "
                                + ", ".join(f"{name}_{c}" for c in TENSOR))
            if values.ndim == 2:
                return np.linalg.norm(values, axis=1), unit, f"|{name}|"
            return values, unit, name
        base, _, suffix = name.rpartition("_")
        if name in self.names() and base in self.arrays:
            values = self.arrays[base]
            k = (TENSOR if values.shape[1] == 6 else AXES).index(suffix)
            return values[:, k], self.units[base], f"{base} {suffix}"
        raise PlotError(f"there is no field '{name}'; there are " + ", ".join(self.names()))

    def array(self, name):
        if name not in self.arrays:
            raise PlotError(f"this frame has no {name}")
        return self.arrays[name]

    def section(self):
        """Of particles in space their volumes; of others their areas in the plane of the model."""
        volume = self.array("volume")
        if not is_axisymmetric(self.path):
            return volume
        return volume / (2 * np.pi * np.abs(self.x[:, 0]))  # rings; x is the radius

    def caption(self):
        where = f"step {self.step},  t = {self.time:.6g} s"
        return f"{self.title}\n{where}" if self.title else where


def text(attribute):
    return attribute.decode() if isinstance(attribute, bytes) else str(attribute)


def von_mises(s):
    xx, yy, zz, xy, yz, xz = s.T
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.sqrt(normal / 2 + 3 * (xy**2 + yz**2 + xz**2))


def manifest_title(run):
    try:
        return json.loads((run / "manifest.json").read_text()).get("title", "")
    except (OSError, ValueError):
        return ""


def is_axisymmetric(frame):
    try:
        scenario = json.loads((frame.parent.parent / "scenario.full.json").read_text())
        return scenario.get("analysis", {}).get("plane") == "axisymmetric"
    except (OSError, ValueError):
        return False


def open_state(path, step):
    if path.is_file():
        return State(path)
    frames = {int(file.stem.rpartition("_")[2]): file
              for file in sorted((path / "frames").glob("particles_*.hdf"))}
    if not frames:
        raise PlotError(f"{path} is neither a frame nor a run with frames")
    if step is None:
        step = max(frames)
    if step not in frames:
        steps = ", ".join(map(str, frames))
        raise PlotError(f"{path} has no frame at step {step}; its steps are {steps}")
    return State(frames[step], manifest_title(path))


def cut(state, plane):
    """Particles to draw of a 3D state in their order, their two axes, and a text that says which they are."""
    size = np.cbrt(np.median(np.abs(state.array("volume"))))
    if plane == "top":
        return np.argsort(state.x[:, 2], kind="stable"), [0, 1], "from above"  # the highest last
    if plane:
        axis, _, value = plane.partition("=")
        if axis not in AXES:
            raise PlotError(f"--slice {plane}: expected x=NUMBER, y=NUMBER, z=NUMBER or top")
        normal = AXES.index(axis)
        try:
            position = float(value) if value else np.median(state.x[:, normal])
        except ValueError:
            raise PlotError(f"--slice {plane}: '{value}' is not a number") from None
    else:
        normal = least_motion(state)
        position = (state.x[:, normal].min() + state.x[:, normal].max()) / 2
    # Particles whose cube the plane cuts; of a plane between two layers, both.
    chosen = np.abs(state.x[:, normal] - position) <= 0.55 * size
    if not chosen.any():
        low, high = state.x[:, normal].min(), state.x[:, normal].max()
        raise PlotError(f"no particle near {AXES[normal]} = {position:g}; "
                        f"they lie between {low:g} and {high:g}")
    return chosen, [a for a in range(3) if a != normal], f"{AXES[normal]} = {position:.4g} m"


def squares(x, side):
    """Corners (particles, 4, 2) of squares around x."""
    corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
    return x[:, None, :] + side[:, None, None] * corners


def least_motion(state):
    """The axis along which the particles moved least; of several the thinnest of the body."""
    motion = np.sqrt(np.nanmean(state.arrays.get("displacement", np.zeros((1, 3))) ** 2, axis=0))
    still = motion <= motion.min() + 0.01 * motion.max()
    return int(np.argmin(np.where(still, np.ptp(state.x, axis=0), np.inf)))


def figure_for(x):
    """A figure whose axes have the shape of the body."""
    low, high = x.min(axis=0), x.max(axis=0)
    extent = np.maximum(high - low, 1e-3 * max(np.ptp(x), 1e-300))
    aspect = np.clip(extent[1] / extent[0], 0.15, 2.5)
    width = 8.0 if aspect < 1 else 8.0 / aspect**0.5
    figure, axes = plt.subplots(figsize=(width + 1.6, width * aspect + 1.5),
                                dpi=DOTS_PER_INCH)
    margin = 0.03 * extent.max()
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    return figure, axes


def draw_particles(state, arguments):
    values, unit, label = state.field(arguments.field)
    chosen, axes_drawn, note = np.ones(len(state.x), bool), [0, 1], ""
    if state.dim == 3:
        chosen, axes_drawn, note = cut(state, arguments.slice)
    x, values = state.x[chosen][:, axes_drawn], values[chosen]
    if arguments.normalise:
        values, unit = values / arguments.normalise, ""
        label += f" / {arguments.normalise:g}"
    finite = np.isfinite(values)
    if not finite.all():
        print(f"plot.py: {np.sum(~finite)} particles have NaN or infinity here; drawn red",
              file=sys.stderr)

    figure, axes = figure_for(x[np.isfinite(x).all(axis=1)])
    low, high = arguments.range or (values[finite].min(), values[finite].max())
    side = np.abs(state.section()[chosen]) ** (1 / state.dim)
    for size in (UNDERLAY, 1):
        points = PolyCollection(squares(x, size * side), array=values, cmap=colours(arguments.map),
                                clim=(low, high), linewidths=0, antialiased=False, rasterized=True)
        axes.add_collection(points)
    outside = (bool((values[finite] < low).any()), bool((values[finite] > high).any()))
    extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[outside]
    unit = "" if unit in ("", "-") else f" [{unit}]"
    beside = make_axes_locatable(axes).append_axes("right", size=0.18, pad=0.12)
    figure.colorbar(points, cax=beside, label=label + unit, extend=extend)
    axes.set_xlabel(f"{AXES[axes_drawn[0]]} [m]")
    axes.set_ylabel(f"{AXES[axes_drawn[1]]} [m]")
    axes.set_title(state.caption() + (f",  {note}" if note else ""), fontsize=11)
    axes.set_facecolor("#f4f4f4")
    return figure


def colours(name):
    try:
        colour_map = matplotlib.colormaps[name].copy()
    except KeyError:
        raise PlotError(f"there is no colour map '{name}'; try viridis, cividis, inferno") from None
    colour_map.set_bad("red")
    return colour_map


def draw_history(run):
    path = run / "history.csv"
    try:
        table = np.atleast_1d(np.genfromtxt(path, delimiter=",", names=True))
    except OSError as error:
        raise PlotError(f"cannot read {path}: {error.strerror or error}") from None
    if len(table) == 0 or table.dtype.names is None:
        raise PlotError(f"{path} has no rows")
    figure, (energies, drift) = plt.subplots(2, 1, sharex=True, figsize=(9, 6.5), layout="constrained",
                                             dpi=DOTS_PER_INCH, height_ratios=[2.2, 1])
    palette = dict(kinetic="#0072b2", internal="#d55e00", external="#009e73", damping="#cc79a7")
    for name, colour in palette.items():
        if np.any(table[name] != 0):
            energies.plot(table["time"], table[name], color=colour, label=name, lw=1.6)
    energies.set_ylabel("energy [J]")
    if energies.lines:
        energies.legend(frameon=False, ncols=4, loc="upper center", bbox_to_anchor=(0.5, 1.12))
    drift.plot(table["time"], table["balance"], color="#333333", lw=1.3)
    drift.set_ylabel("balance [J]")
    drift.set_xlabel("time [s]")
    for axes in (energies, drift):
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
        axes.margins(x=0)
    figure.suptitle(manifest_title(run) or run.name, fontsize=11)
    return figure


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path, help="run folder or frame (.hdf)")
    parser.add_argument("--field", default="speed", help="what the colours show (default: speed)")
    parser.add_argument("--step", type=int, help="step of the frame (default: the last one)")
    parser.add_argument("--normalise", type=float, metavar="VALUE", help="divide the field by this")
    parser.add_argument("--range", type=float, nargs=2, metavar=("LOW", "HIGH"),
                        help="ends of the colour scale (default: smallest and largest value)")
    parser.add_argument("--slice", metavar="AXIS=VALUE",
                        help="plane of a 3D state, or 'top' (default: the middle, across the least motion)")
    parser.add_argument("--map", default="viridis", help="colour map (default: viridis)")
    parser.add_argument("--history", action="store_true", help="draw the energies over time instead")
    parser.add_argument("-o", "--output", type=pathlib.Path,
                        help="picture (.png, .pdf, .svg); default: in the run folder")
    return parser.parse_args()


def draw(arguments):
    if not arguments.run.exists():
        raise PlotError(f"{arguments.run} does not exist")
    place = arguments.run if arguments.run.is_dir() else arguments.run.parent
    if arguments.history:
        figure, name = draw_history(place), "history.png"
    else:
        state = open_state(arguments.run, arguments.step)
        figure, name = draw_particles(state, arguments), f"{arguments.field}_{state.step}.png"
    output = arguments.output or place / name
    try:
        figure.savefig(output, bbox_inches="tight")
    except (OSError, ValueError) as error:
        raise PlotError(f"cannot write {output}: {getattr(error, 'strerror', error)}") from None
    print(output)


if __name__ == "__main__":
    try:
        draw(parse_arguments())
    except PlotError as error:
        sys.exit(f"plot.py: {error}")
