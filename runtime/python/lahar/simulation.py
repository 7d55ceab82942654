"""A simulation in the process, step by step."""
from __future__ import annotations

from types import TracebackType
from typing import Any, Optional

from . import _engine
from .errors import InvalidInput
from .frame import Frame
from .scenario import Scenario, warn


class Simulation:
    """A scenario that is stepped in the process. It writes no files, and has the bits of `lahar run`.

    Between steps, `particles` has copies of all fields by particle id, and `patches()` shows the
    particles where the engine keeps them, without a copy.
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
        """Take so many steps, or fewer where the end of the scenario comes first. Returns the number
        of steps done since the start. Ctrl-C stops soon; the simulation can go on. Raises
        InvalidInput where no step of the scenario is left: see `finished`."""
        if steps > 0 and self._live.finished:
            raise InvalidInput(f"the scenario has ended at step {self.steps}, {self.time:.6g} s: no step is left. "
                               "For more, make analysis.end_time (or nsteps) larger; to step to the end, use "
                               "run(), or `while not sim.finished`")
        return self._advance(steps)

    def _advance(self, steps: int) -> int:
        self._frame = None
        try:
            self._live.advance(steps)
        finally:
            warn(self._live.take_warnings(), stacklevel=2)
        return self._live.step

    def run(self) -> int:
        """Take all steps of the scenario that are left, if any. Returns the number of steps done since
        the start."""
        return self._advance(2**62)

    @property
    def steps(self) -> int:
        """Steps done."""
        return self._live.step

    @property
    def time(self) -> float:
        """[s]"""
        return self._live.time

    @property
    def finished(self) -> bool:
        """No step of the scenario is left."""
        return self._live.finished

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
        return f"<lahar.Simulation step {self.steps}, {self.time:.6g} s>"
