"""What can go wrong, as the engine says it."""
from __future__ import annotations

from typing import NamedTuple, Sequence


class Problem(NamedTuple):
    """One mistake in the input."""

    message: str  #: what was found, and what is allowed
    where: str  #: JSON pointer into the scenario, such as /materials/0/density; may be empty
    hint: str  #: what to do; may be empty
    file: str
    line: int  #: from 1 on; 0: the file as a whole


class LaharError(Exception):
    """Any error of the engine."""


class InvalidInput(LaharError, ValueError):
    """The scenario, or what was asked for, is not valid: `problems` has every mistake."""

    def __init__(self, message: str, problems: Sequence[Problem] = ()) -> None:
        super().__init__(message)
        self.problems = list(problems)


class SimulationFailed(LaharError, RuntimeError):
    """A step could not be taken: a lost particle, a number that is not finite, no equilibrium."""


class FileError(LaharError, OSError):
    """A file cannot be read or written."""


class LaharWarning(UserWarning):
    """What the engine warns of."""
