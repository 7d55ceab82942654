"""One run of a study, in a process of its own: python -m lahar.study_worker FOLDER THREADS PIPE.

FOLDER.json has the scenario. Errors go to standard error, which is the run's log. The share of the run
that is done goes to the file descriptor PIPE.
"""
from __future__ import annotations

import contextlib
import json
import os
import sys
import warnings
from pathlib import Path

from .errors import LaharError, SimulationFailed
from .results import Run, Safety
from .scenario import Scenario
from .studies import inputs_changed


def has_checkpoint(folder: Path) -> bool:
    return any(folder.glob("checkpoints/*.h5")) or any(folder.glob("*/checkpoints/*.h5"))


def begins(folder: Path, is_search: bool) -> dict[str, object]:
    """How the run begins: anew, or from its last checkpoint. A search for a factor of safety goes on
    with its trials."""
    if is_search:
        return search_begins(folder)
    try:
        run = Run(folder)
    except FileNotFoundError:
        return {}
    goes_on = run.status in ("running", "stopped") and has_checkpoint(folder) and not inputs_changed(run)
    return {"restart": "latest"} if goes_on else {"overwrite": True}


def search_begins(folder: Path) -> dict[str, object]:
    try:
        search = Safety(folder)
    except FileNotFoundError:
        return {}
    try:
        rest = search.equilibrium
    except FileNotFoundError:
        return {"overwrite": True}
    goes_on = search.status != "failed" and has_checkpoint(rest.folder) and not inputs_changed(rest)
    return {"restart": "latest"} if goes_on else {"overwrite": True}


def main(folder: Path, threads: int, pipe: int) -> int:
    case = json.loads(folder.with_name(folder.name + ".json").read_text(encoding="utf-8"))
    scenario = Scenario(case["scenario"], folder=case["folder"], name=case["name"],
                        as_cbgeo=case["as_cbgeo"])
    parent = os.getppid()
    os.set_blocking(pipe, False)

    def is_wanted(step: int, time: float, share: float) -> bool:
        with contextlib.suppress(OSError):  # the pipe is full, or its reader has ended
            os.write(pipe, f"{share:.4f}\n".encode())
        return os.getppid() == parent  # a study that was killed: stop with a checkpoint

    try:
        bounds = case.get("safety")
        start = begins(folder, bounds is not None)
        if bounds is not None:
            scenario.safety(folder, threads=threads, progress=is_wanted, **{**bounds, **start})
        else:
            scenario.run(folder, threads=threads, progress=is_wanted, **start)  # type: ignore[arg-type]
    except SimulationFailed:
        return 1  # the manifest, or safety.json, says why
    except LaharError as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    warnings.simplefilter("ignore")  # they are in the manifest
    sys.exit(main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])))
