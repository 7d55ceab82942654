"""Cases of the verification book, one per file, and what they share.

A case is a module with

    TITLE, SHORT, CHECKS         texts of the page: name, a few words, and what is checked
    REFERENCE, FIGURE            against what, and what the figure shows
    scenarios(cell, step)        scenarios by name; `cell` and `step` are factors: 1 or 0.5
    measure(runs)                a list of Number, from the runs by name
    draw(axes, results)          the figure; results[variant][name] is a run

and, where it differs,

    VARIANTS                     which of the variants below are run
    SAYS                         what the numbers say
    ASIDE                        names of numbers that show what goes wrong: no errors of the case
    TOLERANCE                    by how much of `scale` numbers may differ on another machine
    execute(scenario, folder, threads)   runs a scenario, if `Scenario.run` is not what does it

`examples/verification-book` runs the cases and writes the page.
"""
from __future__ import annotations

import pathlib
from typing import NamedTuple, Optional

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: Name: factors of cell and step. With half the cell the step stays the same share of the stable one.
VARIANTS = {"(dt, h)": (1.0, 1.0), "(dt/2, h)": (1.0, 0.5), "(dt/2, h/2)": (0.5, 0.5)}
FIRST = next(iter(VARIANTS))
GRAVITY = 9.81  # [m/s^2]


class Number(NamedTuple):
    """One measured number beside its reference."""

    name: str
    value: float
    reference: float
    unit: str = ""
    scale: Optional[float] = None  #: what errors are a share of; without it the reference

    @property
    def error(self) -> float:
        return (self.value - self.reference) / abs(self.scale or self.reference)


def read(file):
    """A scenario of the repository: read("examples/dam-break.json")."""
    import lahar

    return lahar.Scenario.read(ROOT / file)


def scenario(values, name):
    import lahar

    return lahar.Scenario(values, name=name, folder=ROOT / "examples")


def refine(case, cell, step):
    """Make the cells of a box and the steps smaller. Sets that depend on the cell are the case's."""
    mesh = case["mesh"]["structured"]
    size = mesh["cell_size"]
    mesh["cell_size"] = [one * cell for one in size] if isinstance(size, list) else size * cell
    if "counts" in mesh:
        mesh["counts"] = [round(count / cell) for count in mesh["counts"]]
    analysis = case["analysis"]
    if "dt" in analysis:
        analysis["dt"] *= step
        if "nsteps" in analysis:
            analysis["nsteps"] = round(analysis["nsteps"] / step)
    elif step != cell:  # steps that are a share of the stable one become shorter with the cell
        settings = analysis.setdefault("time_step", {})
        settings["safety"] = settings.get("safety", 0.4) * step / cell
    return case


def line(axes, x, y, label="reference"):
    axes.plot(x, y, color="black", lw=1, label=label)


def finish(axes, x, y, legend=True):
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if legend:
        axes.legend(frameon=False)
