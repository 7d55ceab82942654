"""Pictures by matplotlib."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional

import numpy as np
import numpy.typing as npt

from .frame import Frame

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

Numbers = npt.NDArray[np.float64]


def draw(frame: Frame, field: str, *, ax: Optional[Axes] = None, plane: str = "", **style: Any) -> Axes:
    """The particles in a plane, coloured by a field. In three dimensions those in front are drawn
    last."""
    import matplotlib.pyplot as plt

    if ax is None:
        ax = plt.figure().add_subplot()
    plane = plane or ("xy" if frame.dim == 2 else "xz")
    first, second = ("xyz".index(axis) for axis in plane)
    x, values = frame["coordinates"], frame.scalar(field)
    order = np.arange(len(frame))
    if frame.dim == 3:
        depth = x[:, 3 - first - second]
        order = np.argsort(depth if plane == "xy" else -depth, kind="stable")
    size = float(np.clip(40000 / max(len(frame), 1), 0.5, 40.0))  # dots that about touch each other
    style = {"s": size, "linewidths": 0.0, **style}
    shown = ax.scatter(x[order, first], x[order, second], c=values[order], **style)
    assert ax.figure is not None
    ax.figure.colorbar(shown, ax=ax, label=label_of(field, frame.unit(field)))
    ax.set(xlabel=f"{plane[0]} [m]", ylabel=f"{plane[1]} [m]", title=f"{frame.time:.4g} s")
    ax.set_aspect("equal")
    return ax


def label_of(name: str, unit: str) -> str:
    return name if unit in ("", "-") else f"{name} [{unit}]"


def draw_map(x: Numbers, y: Numbers, values: Numbers, label: str, *, ax: Optional[Axes] = None,
             **style: Any) -> Axes:
    """Values at the centres of a raster's columns and rows."""
    import matplotlib.pyplot as plt

    if ax is None:
        ax = plt.figure().add_subplot()
    shown = ax.pcolormesh(x, y, values, shading="nearest", **style)
    assert ax.figure is not None
    ax.figure.colorbar(shown, ax=ax, label=label)
    ax.set(xlabel="x [m]", ylabel="y [m]")
    ax.set_aspect("equal")
    return ax


def draw_trials(trials: pandas.DataFrame, bracket: tuple[float, float], *, ax: Optional[Axes] = None) -> Axes:
    """Displacements over the factors by which strength was divided."""
    import matplotlib.pyplot as plt

    if ax is None:
        ax = plt.figure().add_subplot()
    for stable, label, colour in ((True, "equilibrium", "tab:blue"), (False, "fails", "tab:red")):
        some = trials[trials["stable"] == stable]
        ax.plot(some["factor"], some["displacement"], "o", color=colour, label=label)
    if np.isfinite(bracket).all():
        ax.axvspan(*bracket, color="0.5", alpha=0.4, label=f"factor of safety {sum(bracket) / 2:.4g}")
    ax.set(xlabel="factor by which strength is divided", ylabel="largest displacement [m]")
    ax.legend()
    return ax
