"""A simulation in the process, step by step."""
from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Optional

import numpy as np
import numpy.typing as npt

from . import _engine
from .errors import InvalidInput
from .frame import Frame
from .scenario import Scenario, warn

if TYPE_CHECKING:
    import pandas


class Body(NamedTuple):
    """A rigid body at present. Arrays have three components in two dimensions, too."""

    name: str
    place: npt.NDArray[np.float64]  #: [m] of its centre
    velocity: npt.NDArray[np.float64]  #: [m/s]
    rotation: npt.NDArray[np.float64]  #: [rad] from the start to now, without whole turns: a vector along its axis
    spin: npt.NDArray[np.float64]  #: [rad/s]
    force: npt.NDArray[np.float64]  #: [N] of particles on it
    torque: npt.NDArray[np.float64]  #: [N m] of particles about its centre


class Simulation:
    """A scenario that is stepped in the process. It writes no files, and has the bits of `lahar run`.

    Between steps, `particles` has copies of all fields by particle id, and `patches()` shows the
    particles where the engine keeps them, without a copy.

    Stages of a scenario follow each other. Each has steps and a time of its own, from 0 on: `stage`
    is the present one. A stage that has ended shows its end until the next step is asked for:

        for stage in sim.stages:
            sim.run(stage)
            print(stage, sim.particles["displacement"].max())
    """

    def __init__(self, scenario: Scenario, *, threads: Optional[int] = None) -> None:
        self._core: Optional[_engine.Simulation] = _engine.Simulation(scenario._text(), threads or 0)
        self._frame: Optional[Frame] = None
        warn(self._core.take_warnings(), stacklevel=2)

    @property
    def _live(self) -> _engine.Simulation:
        if self._core is None:
            raise RuntimeError("the simulation is closed")
        return self._core

    def step(self, steps: int = 1) -> int:
        """Take so many steps, or fewer where the end of the scenario, or of the stage, comes first.
        Where the stage has ended, the next one begins. Returns the number of steps done since the
        start of the scenario, or of the stage. Ctrl-C stops soon; the simulation can go on. Raises
        InvalidInput where no step of the scenario is left: see `finished`."""
        if steps > 0 and self.finished:
            of_stage = f"in stage {self.stage} " if self.stage else ""
            raise InvalidInput(f"the scenario has ended {of_stage}at step {self.steps}, {self.time:.6g} s: no step is "
                               "left. For more, make analysis.end_time (or nsteps) larger; to step to the end, use "
                               "run(), or `while not sim.finished`")
        if steps > 0 and self.stage_finished:
            self._begin_next_stage()
        return self._advance(steps)

    def _advance(self, steps: int) -> int:
        self._frame = None
        try:
            self._live.advance(steps)
        finally:
            warn(self._live.take_warnings(), stacklevel=3)
        return self._live.step

    def _begin_next_stage(self) -> None:
        self._frame = None
        try:
            self._live.begin_next_stage()
        finally:
            warn(self._live.take_warnings(), stacklevel=3)

    def run(self, stage: str = "") -> int:
        """Take all steps of the scenario that are left, if any; with the name of a stage those up to
        its end. Returns the number of steps done since the start of the scenario, or of the stage.
        Raises InvalidInput if the scenario has no such stage, or if a later one has begun."""
        last = len(self.stages) - 1
        if stage:
            if stage not in self.stages:
                known = ", ".join(self.stages) or "none"
                raise InvalidInput(f"the scenario has no stage {stage}; it has: {known}")
            last = self.stages.index(stage)
            if last < self._live.stage:
                raise InvalidInput(f"stage {stage} has ended, {self.stage} has begun: make a new Simulation to have it "
                                   "again")
        done = self._advance(2**62)
        while self._live.stage < last and self._live.finished:
            self._begin_next_stage()
            done = self._advance(2**62)
        return done

    @property
    def stages(self) -> list[str]:
        """Names of the stages of the scenario, in their order; empty without stages."""
        return self._live.stages

    @property
    def stage(self) -> str:
        """The name of the present stage; empty without stages."""
        return self.stages[self._live.stage] if self.stages else ""

    @property
    def stage_finished(self) -> bool:
        """No step of the present stage is left."""
        return self._live.finished

    @property
    def steps(self) -> int:
        """Steps done in the present stage."""
        return self._live.step

    @property
    def time(self) -> float:
        """[s] in the present stage"""
        return self._live.time

    @property
    def finished(self) -> bool:
        """No step of the scenario is left."""
        return self._live.finished and self._live.stage >= len(self.stages) - 1

    @property
    def particles(self) -> Frame:
        """The present fields by ascending particle id: copies, as frames of a run have them."""
        if self._frame is None:
            self._frame = Frame(self._live.frame())
        return self._frame

    def patches(self) -> list[_engine.Patch]:
        """The particles where the engine keeps them, patch by patch: nothing is copied.

        `patch["velocity"]` is a read-only view of slots, of which `patch.used` are in use: in each
        patch, particles lie cell by cell, with free slots between. `patch.columns()` has names,
        units and components; tensors in 2D are as stored (stress xx yy zz xy, strain xx yy xy).
        Views keep the simulation from taking steps: delete them, or copy what you keep.
        """
        return self._live.patches()

    @property
    def sums(self) -> dict[str, Any]:
        """Mass, momentum and energies of the whole model at present, as in history.csv."""
        return self._live.sums()

    @property
    def bodies(self) -> dict[str, Body]:
        """Rigid bodies by name: where they are, how they move, and what particles do to them."""
        found: dict[str, Body] = {}
        for name, values in self._live.sums()["bodies"].items():
            found[name] = Body(name, **{key: np.array(value) for key, value in values.items()})
        return found

    @property
    def gauges(self) -> dict[str, pandas.DataFrame]:
        """What gauges have measured so far in the present stage, by name: the tables that a run would
        have now, with a row wherever the scenario asks for one. `attrs["units"]` has the units."""
        import pandas

        found = {}
        for name, (columns, rows) in self._live.gauges().items():
            table = pandas.DataFrame(rows, columns=[column for column, _ in columns])
            table = table.astype({column: np.int64 for column in ("step", "id") if column in table})
            table.attrs["units"] = dict(columns)
            found[name] = table
        return found

    @property
    def info(self) -> dict[str, Any]:
        """Sizes, the next time step and its limit."""
        return self._live.info()

    def close(self) -> None:
        """Free the memory, once no view of it is left."""
        self._core = self._frame = None

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        self.close()

    def __repr__(self) -> str:
        if self._core is None:
            return "<lahar.Simulation, closed>"
        stage = f"stage {self.stage}, " if self.stage else ""
        return f"<lahar.Simulation {stage}step {self.steps}, {self.time:.6g} s>"
