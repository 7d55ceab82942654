"""Parameter studies: many runs of one scenario, which go on where they were stopped."""
from __future__ import annotations

import hashlib
import itertools
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, NamedTuple, Optional, Union

from .progress import Line, is_watched
from .results import Run, Safety
from .scenario import PathLike, Scenario

if TYPE_CHECKING:
    import pandas

#: Values by path, of which all combinations are run; or one mapping of paths to values per run.
Parameters = Union[Mapping[str, Sequence[Any]], Sequence[Mapping[str, Any]]]


class StudyRun(NamedTuple):
    """One run of a study."""

    parameters: dict[str, Any]
    folder: Path
    #: "finished", "failed", "stopped", "running" (or killed), "invalid" (nothing was run) or "waiting"
    status: str
    message: str  #: why it is not finished

    @property
    def run(self) -> Run:
        """What it wrote; raises FileNotFoundError where nothing was run."""
        return Run(self.folder)

    @property
    def safety(self) -> Safety:
        """The same, of a study of factors of safety."""
        return Safety(self.folder)


_safety_measures: dict[str, Callable[..., Any]] = {
    "factor": lambda found: found.factor,
    "stable": lambda found: found.bracket[0],
    "fails": lambda found: found.bracket[1],
}


class Study:
    """The runs of a study in their folder, whatever state they are in."""

    def __init__(self, folder: PathLike) -> None:
        self.folder = Path(folder)
        index = self.folder / "study.json"
        if not index.is_file():
            raise FileNotFoundError(f"{self.folder} is not the folder of a study: it has no study.json")
        study = json.loads(index.read_text(encoding="utf-8"))
        self._entries = study["runs"]
        self.is_of_safety: bool = "safety" in study  #: its runs are searches for factors of safety

    @property
    def runs(self) -> list[StudyRun]:
        """All runs as they are now, in the order of the parameters' values."""
        return [self._state(entry["key"], entry["parameters"]) for entry in self._entries]

    def _state(self, key: str, parameters: dict[str, Any]) -> StudyRun:
        folder, log = self.folder / key, self.folder / f"{key}.log"
        said = log.read_text(encoding="utf-8", errors="replace").strip() if log.is_file() else ""
        try:
            run: Union[Run, Safety] = Safety(folder) if self.is_of_safety else Run(folder)
        except FileNotFoundError:
            return StudyRun(parameters, folder, "invalid" if said else "waiting", said)
        return StudyRun(parameters, folder, run.status, run.message or said)

    def table(self, **measures: Callable[..., Any]) -> pandas.DataFrame:
        """A row for each run: parameters, status, message, and what `measures` give for runs that
        have finished, such as `runout=lambda run: run.frames[-1]["coordinates"][:, 0].max()`.

        A study of factors of safety has the columns factor, stable and fails (the bracket), and
        measures get a Safety."""
        import pandas

        all_measures = {**(_safety_measures if self.is_of_safety else {}), **measures}
        rows = []
        for one in self.runs:
            row = {**one.parameters, "status": one.status, "message": one.message}
            for name, measure in all_measures.items():
                row[name] = measure(one.safety if self.is_of_safety else one.run) if one.status == "finished" else None
            rows.append(row)
        table = pandas.DataFrame(rows)
        return table.astype({name: float for name in all_measures if table[name].isna().all()})

    def __len__(self) -> int:
        return len(self._entries)

    def __iter__(self) -> Iterator[StudyRun]:
        return iter(self.runs)

    def __repr__(self) -> str:
        states = [one.status for one in self.runs]
        counts = ", ".join(f"{states.count(s)} {s}" for s in sorted(set(states)))
        return f"<lahar.Study {self.folder}: {counts}>"


def study(folder: PathLike, scenario: Scenario, parameters: Parameters, *, workers: Optional[int] = None,
          threads: int = 1, again: bool = False, progress: Union[bool, Callable[[str], Any]] = True,
          safety: Union[bool, Mapping[str, float]] = False) -> Study:
    """Run a scenario with other values, `workers` at a time, each in a process of its own.

    `parameters` is {"materials.0.friction": [20, 25, 30], ...}, of which all combinations are run,
    or a list of such mappings with one value each. A run is known by all its values: called again,
    also with more of them, the study keeps the runs that have finished and goes on with those that
    were stopped or killed, from their last checkpoint. Runs that failed are in the table with the
    reason; `again` runs them once more. Ctrl-C stops all runs with a checkpoint.

    On a terminal and in a notebook a line shows how far the runs are, unless `progress` is False. A
    function, such as `print`, gets a line of text at the start and whenever a run has ended.

    With `safety` each run is a search for the factor of safety, `Scenario.safety()`: True, or
    {"tolerance": 0.005, "most": 4}. Called again with other bounds, searches go on with their trials.
    """
    bounds = _bounds(safety)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    made = {file.stem[-16:]: file.stem for file in folder.glob("*.json")}
    entries = [_entry(folder, scenario, values, made, bounds) for values in combinations(parameters)]
    index: dict[str, Any] = {"lahar_study": 1, "runs": entries}
    if bounds is not None:
        index["safety"] = bounds
    partial = folder / f"study.json.{os.getpid()}"
    partial.write_text(json.dumps(index, indent=1), encoding="utf-8")
    partial.replace(folder / "study.json")
    found = Study(folder)
    waiting = [entry["key"] for entry, state in zip(entries, found.runs) if _is_due(state, again, bounds)]
    _Workers(folder, workers or max(1, (os.cpu_count() or 1) // threads), threads).run(
        list(dict.fromkeys(waiting)), len({entry["key"] for entry in entries}), progress)
    return found


def combinations(parameters: Parameters) -> list[dict[str, Any]]:
    """The values of each run."""
    if not isinstance(parameters, Mapping):
        return [dict(one) for one in parameters]
    return [dict(zip(parameters, values)) for values in itertools.product(*parameters.values())]


def _bounds(safety: Union[bool, Mapping[str, float]]) -> Optional[dict[str, float]]:
    """Those of searches for factors of safety; None: runs are no searches."""
    if safety is False:
        return None
    default = {"tolerance": 0.01, "most": 16.0}
    given = {} if safety is True else {name: float(value) for name, value in safety.items()}
    if unknown := ", ".join(sorted(set(given) - set(default))):
        raise ValueError(f"safety does not know {unknown}; it knows: {', '.join(default)}")
    return {**default, **given}


def _entry(folder: Path, scenario: Scenario, values: dict[str, Any], made: Mapping[str, str],
           bounds: Optional[dict[str, float]]) -> dict[str, Any]:
    """Writes the scenario of a run, under a name that follows from all its values."""
    changed = scenario.changed(values)
    case = {"scenario": json.loads(changed.to_json()), "folder": str(changed.folder.resolve()),
            "name": changed.name, "as_cbgeo": changed.as_cbgeo}
    if bounds is not None:
        case["safety"] = {}  # searches with other bounds are the same one
    number = hashlib.sha256(json.dumps(case, sort_keys=True).encode()).hexdigest()[:16]
    plain = json.loads(Scenario({"values": values}).to_json())["values"]
    # A run that was made for other parameters keeps its name.
    key = made.get(number, f"{_words(plain)}{number}")
    if bounds is not None:
        case["safety"] = bounds
    (folder / f"{key}.json").write_text(json.dumps(case, indent=1), encoding="utf-8")
    return {"key": key, "parameters": plain}


def _words(values: Mapping[str, Any]) -> str:
    """What a folder is named after: "friction=25_cohesion=0_", as far as names and values are short."""
    last = [path.rsplit(".", 1)[-1] for path in values]
    names = last if len(set(last)) == len(last) else list(values)
    words = ""
    for name, value in zip(names, values.values()):
        word = re.sub(r"[^A-Za-z0-9_.+=-]+", "-", f"{name}={value}")
        if len(words) + len(word) > 80:
            break
        words += f"{word}_"
    return words


def _is_due(state: StudyRun, again: bool, bounds: Optional[dict[str, float]]) -> bool:
    if state.status in ("failed", "invalid"):
        return again
    if state.status != "finished":
        return True
    if bounds is None:
        return inputs_changed(state.run)
    record = state.safety.record
    return any(record[name] != value for name, value in bounds.items()) or inputs_changed(state.safety.equilibrium)


def inputs_changed(run: Run) -> bool:
    """Whether a file that the scenario refers to is another one than when it was run."""
    for part in run.stages.values() or [run]:
        for one in part.manifest["inputs"]:
            try:
                now = hashlib.sha256(Path(one["file"]).read_bytes()).hexdigest()
            except OSError:
                now = None
            if now != one["sha256"]:
                return True
    return False


class _Workers:
    """Processes that run cases, a few at a time."""

    def __init__(self, folder: Path, most: int, threads: int) -> None:
        self._folder, self._most, self._threads = folder, most, threads
        self._running: dict[str, subprocess.Popen[bytes]] = {}
        self._shares: dict[str, _Share] = {}

    def run(self, keys: list[str], total: int, progress: Union[bool, Callable[[str], Any]]) -> None:
        line = Line()
        waiting = list(keys)
        told = -1
        try:
            while waiting or self._running:
                for key in [k for k, process in self._running.items() if process.poll() is not None]:
                    del self._running[key]
                    self._shares.pop(key).close()
                while waiting and len(self._running) < self._most:
                    key = waiting.pop(0)
                    self._running[key] = self._start(key)
                done = total - len(waiting) - len(self._running)
                if callable(progress):
                    if done != told:
                        progress(self._text(done, total))
                    told = done
                elif progress and is_watched():
                    line.show(self._text(done, total))
                time.sleep(0.05)
        finally:
            self._stop()
            line.clear()

    def _text(self, done: int, total: int) -> str:
        text = f"study: {done} of {total} runs done"
        if self._running:
            shares = ", ".join(f"{100 * self._shares[key].now():.0f} %" for key in self._running)
            text += f", {len(self._running)} running ({shares})"
        return text

    def _start(self, key: str) -> subprocess.Popen[bytes]:
        package = str(Path(__file__).resolve().parent.parent)
        paths = [package, *filter(None, [os.environ.get("PYTHONPATH")])]
        reads, writes = os.pipe()
        self._shares[key] = _Share(reads)
        try:
            with open(self._folder / f"{key}.log", "wb") as log:
                # In a session of its own: Ctrl-C comes to this process, which then tells all.
                return subprocess.Popen(
                    [sys.executable, "-m", "lahar.study_worker", str(self._folder / key), str(self._threads),
                     str(writes)],
                    stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True, pass_fds=[writes],
                    env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)})
        finally:
            os.close(writes)

    def _stop(self) -> None:
        for process in self._running.values():
            process.send_signal(signal.SIGINT)
        for process in self._running.values():
            process.wait()
        for share in self._shares.values():
            share.close()
        self._shares.clear()


class _Share:
    """The share of a run that is done, which its process writes into a pipe, one per line."""

    def __init__(self, reads: int) -> None:
        os.set_blocking(reads, False)
        self._reads, self._text = reads, b""

    def now(self) -> float:
        try:
            while part := os.read(self._reads, 65536):
                self._text = (self._text + part)[-64:]
        except BlockingIOError:
            pass
        lines = self._text.split(b"\n")
        return float(lines[-2]) if len(lines) > 2 else 0.0

    def close(self) -> None:
        os.close(self._reads)
