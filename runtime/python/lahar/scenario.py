"""Scenarios: dictionaries with the names of the input."""
from __future__ import annotations

import copy
import json
import os
import sys
import warnings as python_warnings
from pathlib import Path
from typing import Any, Iterable, Mapping, NamedTuple, Optional, Union

from . import _engine
from .errors import InvalidInput, LaharWarning, SimulationFailed
from .progress import Progress, shown
from .results import Run, Safety

PathLike = Union[str, "os.PathLike[str]"]

_EXIT_SIMULATION = 3


class Check(NamedTuple):
    """What a run of a scenario, or of one of its stages, would be."""

    stage: str  #: name; empty without stages
    dim: int
    particles: int
    cells: int
    nodes: int
    patches: int
    bytes: int  #: memory of particles and nodes
    dt: float  #: [s] first time step
    dt_limit: float  #: [s] stable time step at the start
    seconds: float  #: estimated duration; infinite where it cannot be told
    warnings: list[str]
    side_files: list[str]  #: other files that were read
    full: dict[str, Any]  #: the scenario with every default


class Scenario(dict[str, Any]):
    """A case as a dictionary: keys and values are those of scenario files (`lahar info --reference`).

    `folder` is where names of files in it begin, `name` the file that it stands for. Values may be
    numpy arrays and numbers, and paths.
    """

    folder: Path
    name: str
    as_cbgeo: bool

    def __init__(self, values: Optional[Mapping[str, Any]] = None, *, folder: PathLike = ".",
                 name: str = "scenario", as_cbgeo: bool = False) -> None:
        super().__init__(copy.deepcopy(dict(values or {})))
        self.folder, self.name, self.as_cbgeo = Path(folder), name, as_cbgeo

    @classmethod
    def read(cls, file: PathLike, *, as_cbgeo: bool = False) -> Scenario:
        """Read a scenario file (JSON with comments). Raises InvalidInput where it is not JSON;
        `check()` says whether it is a valid scenario."""
        file = Path(file)
        text = file.read_text(encoding="utf-8")
        values = json.loads(_engine.parse(text, str(file)))
        return cls(values, folder=file.parent, name=str(file), as_cbgeo=as_cbgeo)

    def __deepcopy__(self, memo: dict[int, Any]) -> Scenario:
        return Scenario(self, folder=self.folder, name=self.name, as_cbgeo=self.as_cbgeo)

    def copy(self) -> Scenario:
        """An independent copy."""
        return copy.deepcopy(self)

    def set(self, path: str, value: Any) -> Scenario:
        """Set one value as `--set` does: "materials.0.friction", "materials.sand.friction" or
        "/materials/0/friction". Objects on the way that are missing are made. None removes a key;
        in a stage it stays, because there it removes the key of the scenario. Returns the scenario
        itself."""
        *way, last = path[1:].split("/") if path.startswith("/") else path.split(".")
        removes = value is None and [*way, last][0] != "stages"
        at: Any = self
        for name in way:
            if isinstance(at, list):
                at = at[_index(at, name, path)]
            elif removes and name not in at:
                raise KeyError(f"{path}: there is no {name!r} to remove")
            else:
                at = at.setdefault(name, {})
            if not isinstance(at, (dict, list)):
                raise KeyError(f"{path}: there is nothing in {name}, which is {at!r}")
        if removes:
            if isinstance(at, list):
                raise KeyError(f"{path}: None removes a key, not an entry of a list")
            if last not in at:
                raise KeyError(f"{path}: there is no {last!r} to remove")
            del at[last]
        else:
            at[_index(at, last, path) if isinstance(at, list) else last] = value
        return self

    def changed(self, values: Mapping[str, Any]) -> Scenario:
        """A copy with other values: `case.changed({"materials.0.friction": 25})`."""
        other = self.copy()
        for path, value in values.items():
            other.set(path, value)
        return other

    def to_json(self) -> str:
        """The text of a scenario file."""
        return json.dumps(self, indent=2, default=_plain, allow_nan=False) + "\n"

    def write(self, file: PathLike) -> None:
        """Write a scenario file. Names of other files in it stay as they are."""
        Path(file).write_text(self.to_json(), encoding="utf-8")

    def check(self) -> list[Check]:
        """Read the scenario as a run would. Raises InvalidInput with every mistake; returns what the
        run, or each of its stages, would be."""
        checked = []
        for one in _engine.check(self._text()):
            one["full"] = json.loads(one["full"])
            del one["output"]
            checked.append(Check(**one))
        return checked

    def run(self, folder: PathLike, *, threads: Optional[int] = None, overwrite: bool = False,
            restart: str = "", wall_time: Optional[float] = None,
            progress: Progress = True) -> Run:
        """Run the case as `lahar run` does, into a run folder.

        `restart="latest"` goes on from the last checkpoint in the folder, `overwrite` replaces what
        is there. A function `progress(step, time, share)` is called some times a second, with the
        time in the model [s] and the share of the run that is done. Ctrl-C, `wall_time` [s] and
        `progress` functions that return False write a checkpoint and stop. Raises SimulationFailed
        (the folder then has the last frame), InvalidInput and FileError; what the engine warns of
        are LaharWarnings.
        """
        on_step, end = shown(progress)
        said: list[str] = []
        options = {"output": os.fspath(folder), "threads": threads or 0, "overwrite": overwrite,
                   "restart": restart, "wall_time": wall_time or 0.0,
                   "command": ["python", *sys.argv]}
        try:
            code = _engine.run(self._text(), options, on_step, said)
        finally:
            end()
            warn(said, stacklevel=2)
        run = Run(folder)
        if code == _EXIT_SIMULATION:
            raise SimulationFailed(run.message)
        return run

    def safety(self, folder: PathLike, *, tolerance: float = 0.01, most: float = 16.0,
               threads: Optional[int] = None, overwrite: bool = False, restart: str = "",
               progress: Progress = True) -> Safety:
        """The factor of safety by strength reduction, as `lahar safety` finds it, into a folder.

        The bracket of the factor is at last as narrow as `tolerance`, a share of it; factors above
        `most` are not looked for. `restart="latest"` goes on with the search in the folder and keeps
        its trials, also with another tolerance; `overwrite` replaces what is there. `progress` is
        that of run(): steps and times are those of a trial, and the share is an estimate. Ctrl-C and
        functions that return False stop the search. Raises SimulationFailed where there is no
        equilibrium with full strength, InvalidInput and FileError.
        """
        on_step, end = shown(progress)
        said: list[str] = []
        options = {"output": os.fspath(folder), "threads": threads or 0, "overwrite": overwrite,
                   "restart": restart, "wall_time": 0.0, "tolerance": tolerance, "most": most,
                   "command": ["python", *sys.argv]}
        code = 0
        try:
            code = _engine.safety(self._text(), options, on_step, said)
        finally:
            end()
            if code != _EXIT_SIMULATION:
                warn(said, stacklevel=2)
        found = Safety(folder)
        if code == _EXIT_SIMULATION:
            raise SimulationFailed(found.message)
        return found

    def _text(self) -> _engine.ScenarioText:
        try:
            text = self.to_json()
        except (TypeError, ValueError) as error:
            raise InvalidInput(f"{self.name}: {error}") from error
        return _engine.ScenarioText(text, os.fspath(self.folder), self.name, self.as_cbgeo)

    def __repr__(self) -> str:
        return f"<lahar.Scenario {self.name}: {', '.join(self)}>"


def schema() -> dict[str, Any]:
    """The JSON Schema of scenarios."""
    parsed: dict[str, Any] = json.loads(_engine.schema())
    return parsed


def reference() -> str:
    """Every key of scenarios with its unit, default and bounds."""
    return _engine.reference()


def warn(texts: Iterable[str], stacklevel: int) -> None:
    for text in texts:
        text = text.strip().removeprefix("lahar: warning: ")
        python_warnings.warn(text, LaharWarning, stacklevel=stacklevel + 1)


def _index(items: list[Any], name: str, path: str) -> int:
    """The position of an entry, which `name` gives as a position or as a name."""
    if name.isdigit() and int(name) < len(items):
        return int(name)
    names = [one.get("name") if isinstance(one, dict) else None for one in items]
    if name and names.count(name) == 1:
        return names.index(name)
    if name and names.count(name) > 1:
        raise KeyError(f"{path}: {names.count(name)} entries are named {name!r}; give a position")
    known = [one for one in names if one is not None]
    if known and not name.isdigit():
        raise KeyError(f"{path}: no entry is named {name!r}; there are: {', '.join(map(str, known))}")
    raise KeyError(f"{path}: {name!r} is not a position in a list of {len(items)}")


def _plain(value: Any) -> Any:
    """What numpy and paths are in JSON."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"{value!r} is not a value of a scenario")
