"""What runs wrote."""
from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Iterator, NamedTuple, Optional, Union, overload

import numpy as np
import numpy.typing as npt

from . import _engine
from .errors import FileError
from .frame import Frame

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes


class Run:
    """A run folder: `run.frames[-1]["velocity"]`, `run.history.kinetic`, `run.gauges["toe"]`.

    It may be read while the run goes on. The run of a scenario with stages has a Run for each, by
    name, in `stages`, and no results of its own.
    """

    def __init__(self, folder: Union[str, os.PathLike[str]]) -> None:
        self.folder = Path(folder)
        self.stages: dict[str, Run] = _Stages(self.folder)
        self._planned: list[str] = []  # stages
        if self._is_run(self.folder):
            return
        if (self.folder / "safety.json").is_file():
            raise FileNotFoundError(f"{self.folder} is the folder of a search for a factor of safety: "
                                    "lahar.Safety reads it")
        begun = _stages_in(self.folder)
        inputs = [path / "scenario.json" for path in begun if (path / "scenario.json").is_file()]
        scenario: dict[str, Any] = {}
        if inputs:
            scenario = json.loads(_engine.parse(inputs[-1].read_text(encoding="utf-8"), "scenario.json"))
        if "stages" not in scenario:
            raise FileNotFoundError(f"{self.folder} is not the folder of a run: it has no manifest.json")
        self._planned = [stage["name"] for stage in scenario["stages"]]
        self.stages.update({path.name: Run(path) for path in begun})

    @staticmethod
    def _is_run(folder: Path) -> bool:
        return (folder / "manifest.json").is_file()

    @property
    def manifest(self) -> dict[str, Any]:
        """manifest.json as it is now; of stages the last one's that has begun."""
        if self.stages:
            return list(self.stages.values())[-1].manifest
        parsed: dict[str, Any] = json.loads((self.folder / "manifest.json").read_text(encoding="utf-8"))
        return parsed

    @property
    def status(self) -> str:
        """"running" (also of a run that was killed), "finished", "stopped" or "failed"."""
        status = str(self.manifest["status"])
        return "stopped" if status == "finished" and len(self.stages) < len(self._planned) else status

    @property
    def message(self) -> str:
        """Why it failed or stopped."""
        return str(self.manifest.get("message", ""))

    @property
    def warnings(self) -> list[str]:
        """What the engine warned of, known at the end of the run; of stages the last one's that has
        begun."""
        return list(self.manifest.get("warnings", []))

    @property
    def scenario(self) -> dict[str, Any]:
        """The scenario with every default."""
        parsed: dict[str, Any] = json.loads(self._file("scenario.full.json").read_text(encoding="utf-8"))
        return parsed

    @property
    def frames(self) -> Frames:
        """The frames so far, in order: `run.frames[-1]`, `run.frames.at(time=0.5)`."""
        return Frames(self._file("frames"))

    @property
    def history(self) -> pandas.DataFrame:
        """Mass, momentum and energies over time; `history.attrs["units"]` has the units."""
        table = self._table("history.csv")
        table.attrs["units"] = {c["name"]: c["unit"] for c in self.manifest.get("history", [])}
        return table

    @property
    def rigid_bodies(self) -> pandas.DataFrame:
        """Places, motion, forces and torques of rigid bodies over time."""
        return self._table("rigid_bodies.csv", "rigid bodies")

    @property
    def removed(self) -> pandas.DataFrame:
        """Particles that left the mesh."""
        return self._table("removed.csv", "particles that left the mesh")

    @property
    def gauges(self) -> Mapping[str, pandas.DataFrame]:
        """What gauges measured, by name; `attrs["units"]` has the units of the columns."""
        return _Files(self._file("gauges"), ".csv", _read_gauge)

    @property
    def maps(self) -> Mapping[str, Map]:
        """Rasters of the whole run, by name."""
        units = {one["name"]: one["unit"] for one in self.manifest.get("maps", [])}
        return _Files(self._file("maps"), ".asc",
                      lambda file: Map.read(file)._replace(name=file.stem, unit=units.get(file.stem, "")))

    def plot(self, field: str = "velocity", *, time: Optional[float] = None, step: Optional[int] = None,
             ax: Optional[Axes] = None, **style: Any) -> Axes:
        """Draw the particles of a frame (the last one, or that nearest to `time` or `step`), coloured
        by a field: a scalar, a component such as "stress_xy", or a vector's length. `style` goes to
        matplotlib's scatter(). Three dimensions are drawn as seen along y; `plane="xy"` says
        otherwise."""
        from .drawing import draw

        return draw(self.frames.at(time=time, step=step), field, ax=ax, **style)

    def _file(self, name: str) -> Path:
        if self.stages:
            raise AttributeError(f"{self.folder} has stages: take one, such as "
                                 f"run.stages[{next(iter(self.stages))!r}]")
        return self.folder / name

    def _table(self, name: str, what: str = "") -> pandas.DataFrame:
        import pandas

        file = self._file(name)
        if what and not file.is_file():
            tables = ", ".join(sorted(path.name for path in self.folder.glob("*.csv"))) or "none"
            raise FileError(f"{self.folder} has no {what}; its tables are: {tables}")
        return pandas.read_csv(file, float_precision="round_trip")

    def __repr__(self) -> str:
        stages = f", stages {', '.join(self.stages)}" if self.stages else ""
        return f"<lahar.Run {self.folder}: {self.status}{stages}>"


class Safety:
    """The folder of a search for the factor of safety: `Scenario.safety()`, `lahar safety`.

    It may be read while the search goes on.
    """

    def __init__(self, folder: Union[str, os.PathLike[str]]) -> None:
        self.folder = Path(folder)
        if not (self.folder / "safety.json").is_file():
            raise FileNotFoundError(f"{self.folder} has no safety.json: it is not the folder of a search")

    @property
    def record(self) -> dict[str, Any]:
        """safety.json as it is now."""
        parsed: dict[str, Any] = json.loads((self.folder / "safety.json").read_text(encoding="utf-8"))
        return parsed

    @property
    def status(self) -> str:
        """"running" (also of a search that was killed), "finished", "stopped" or "failed"."""
        return str(self.record["status"])

    @property
    def message(self) -> str:
        """Why it failed or stopped."""
        return str(self.record["message"])

    @property
    def trials(self) -> pandas.DataFrame:
        """The trials so far, in their order: the factor by which strength was divided, whether the
        body was `stable` with it, steps, the largest displacement, and how the trial ended."""
        import pandas

        file = self.folder / "safety.csv"
        if not file.is_file():
            names = ["factor", "stable", "steps", "displacement", "end"]
            table = pandas.DataFrame({name: [] for name in names})
        else:
            table = pandas.read_csv(file, float_precision="round_trip")
            table = table.rename(columns={"displacement [m]": "displacement"})
        table["stable"] = table["stable"] == 1
        table.attrs["units"] = {"displacement": "m"}
        return table

    @property
    def bracket(self) -> tuple[float, float]:
        """The largest factor with an equilibrium, and the least without one (infinite: none failed).
        NaN where the run with full strength has not come to an equilibrium."""
        record = self.record
        if record["stable"] is None:
            return np.nan, np.nan
        return float(record["stable"]), np.inf if record["fails"] is None else float(record["fails"])

    @property
    def factor(self) -> float:
        """The factor of safety: the middle of the bracket, or its lower end where no trial failed."""
        stable, fails = self.bracket
        return stable if np.isinf(fails) else 0.5 * (stable + fails)

    @property
    def divided(self) -> str:
        """What has the strength that trials divide, in words."""
        return str(self.record["divided"])

    @property
    def equilibrium(self) -> Run:
        """The run with full strength."""
        return Run(self.folder / "equilibrium")

    @property
    def mechanism(self) -> Optional[Run]:
        """The trial that failed with the least factor; None where none failed."""
        folder = self.folder / "mechanism"
        return Run(folder) if self.record["mechanism"] is not None and folder.is_dir() else None

    def plot(self, ax: Optional[Axes] = None) -> Axes:
        """Draw how far the body moved in each trial, and the bracket."""
        from .drawing import draw_trials

        return draw_trials(self.trials, self.bracket, ax=ax)

    def __repr__(self) -> str:
        return f"<lahar.Safety {self.folder}: {self.status}, {self.factor:.4g}>"


def _stages_in(folder: Path) -> list[Path]:
    """Folders of stages in their order, of two with one number the later one: those that `lahar
    watch` and `lahar report` show."""
    found = []
    for file in folder.glob("*/manifest.json"):
        manifest = json.loads(file.read_text(encoding="utf-8"))
        if "lahar_run" in manifest:
            found.append((manifest.get("stage", 0), manifest.get("started", ""), file.parent))
    if any(number > 0 for number, _, _ in found):
        latest = {number: path for number, _, path in sorted(found) if number > 0}
        return list(latest.values())
    return [path for _, _, path in sorted(found)]  # manifests of older versions have no number


class _Stages(dict[str, Run]):
    """The stages of a run that have begun, by name."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._folder = folder

    def __missing__(self, name: str) -> Run:
        known = ", ".join(self) or "none"
        raise KeyError(f"{self._folder} has no stage {name}; it has: {known}")


class Frames(Sequence[Frame]):
    """The frames of a run; each is read when it is asked for."""

    def __init__(self, folder: Path) -> None:
        index = folder / "particles.hdf.series"
        entries = json.loads(index.read_text())["files"] if index.is_file() else []
        self.files = [folder / entry["name"] for entry in entries]
        self.times: npt.NDArray[np.float64] = np.array([entry["time"] for entry in entries], dtype=float)  #: [s]
        self.steps: npt.NDArray[np.int64] = np.array(
            [int(re.findall(r"\d+", file.stem)[-1]) for file in self.files], dtype=np.int64)

    def __len__(self) -> int:
        return len(self.files)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> list[Frame]: ...
    def __getitem__(self, index: Union[int, slice]) -> Union[Frame, list[Frame]]:
        if isinstance(index, slice):
            return [Frame.read(file) for file in self.files[index]]
        return Frame.read(self.files[index])

    def at(self, *, time: Optional[float] = None, step: Optional[int] = None) -> Frame:
        """The frame nearest to a time [s] or a step; the last one if neither is given."""
        if not self.files:
            raise IndexError("the run has no frames")
        if time is not None and step is not None:
            raise ValueError("give a time or a step, not both")
        if time is not None:
            return self[int(np.argmin(np.abs(self.times - time)))]
        if step is not None:
            return self[int(np.argmin(np.abs(self.steps - step)))]
        return self[-1]

    def __repr__(self) -> str:
        return f"<lahar.Frames: {len(self)}, {self.times[0]:.4g} to {self.times[-1]:.4g} s>" if self.files else \
            "<lahar.Frames: none>"


class Map(NamedTuple):
    """A raster: `values[0, 0]` is the south-western cell, cells without data are NaN."""

    values: npt.NDArray[np.float64]
    x: npt.NDArray[np.float64]  #: [m] centres of columns
    y: npt.NDArray[np.float64]  #: [m] centres of rows
    name: str = ""
    unit: str = ""

    @classmethod
    def read(cls, file: Union[str, os.PathLike[str]]) -> Map:
        """Read an ESRI ASCII grid."""
        head: dict[str, float] = {}
        lines = Path(file).read_text().splitlines()
        while lines and lines[len(head)].split()[0][:1].isalpha():
            name, value = lines[len(head)].split()
            head[name.lower()] = float(value)
        rows, columns, size = int(head["nrows"]), int(head["ncols"]), head["cellsize"]
        numbers = np.array(" ".join(lines[len(head):]).split(), dtype=float).reshape(rows, columns)
        numbers[numbers == head.get("nodata_value", -9999.0)] = np.nan

        def centres(axis: str, count: int) -> npt.NDArray[np.float64]:
            first = head[f"{axis}llcenter"] if f"{axis}llcenter" in head else head[f"{axis}llcorner"] + size / 2
            return first + size * np.arange(count)

        return cls(numbers[::-1], centres("x", columns), centres("y", rows))

    def plot(self, ax: Optional[Axes] = None, **style: Any) -> Axes:
        """Draw it; `style` goes to matplotlib's pcolormesh()."""
        from .drawing import draw_map, label_of

        return draw_map(self.x, self.y, self.values, label_of(self.name, self.unit), ax=ax, **style)


class _Files(Mapping[str, Any]):
    """Files NAME.ending of a folder, each read when it is asked for."""

    def __init__(self, folder: Path, ending: str, read: Any) -> None:
        self._files = {file.stem: file for file in sorted(folder.glob("*" + ending))}
        self._folder, self._read = folder, read

    def __getitem__(self, name: str) -> Any:
        if name not in self._files:
            known = ", ".join(self._files) or "none"
            raise KeyError(f"{self._folder} has no {name}; it has: {known}")
        return self._read(self._files[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self._files)

    def __len__(self) -> int:
        return len(self._files)

    def __repr__(self) -> str:
        return f"<{self._folder}: {', '.join(self._files) or 'none'}>"


def _read_gauge(file: Path) -> pandas.DataFrame:
    """Columns are called `name [unit]` in the file."""
    import pandas

    table = pandas.read_csv(file, float_precision="round_trip")
    units = {}
    names = []
    for column in table.columns:
        found = re.fullmatch(r"(.*?)\s*\[(.*)\]", column)
        name = found.group(1) if found else column
        units[name] = found.group(2) if found else ""
        names.append(name)
    table.columns = pandas.Index(names)
    table.attrs["units"] = units
    return table
