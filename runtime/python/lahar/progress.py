"""A line that shows how far something is."""
from __future__ import annotations

import sys
import time
from typing import Any, Callable, Optional, Union

#: True: a line on a terminal or in a notebook. A function gets step, time [s] and the share that is
#: done some times a second; it may return False to stop.
Progress = Union[bool, Callable[[int, float, float], Any]]


def is_watched() -> bool:
    return "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())


class Line:
    """Text that replaces itself on standard error."""

    def __init__(self) -> None:
        self._length = 0

    def show(self, text: str) -> None:
        sys.stderr.write("\r" + text.ljust(self._length))
        sys.stderr.flush()
        self._length = len(text)

    def clear(self) -> None:
        if self._length:
            sys.stderr.write("\r" + " " * self._length + "\r")
            sys.stderr.flush()
        self._length = 0


class Bar:
    """The share of a run that is done."""

    def __init__(self, width: int = 30) -> None:
        self._line, self._width, self._begin = Line(), width, time.monotonic()

    def __call__(self, step: int, seconds: float, share: float) -> None:
        share = min(max(share, 0.0), 1.0)
        elapsed = time.monotonic() - self._begin
        left = f", {elapsed * (1 - share) / share:.0f} s left" if share > 0.01 else ""
        bar = ("=" * int(share * self._width)).ljust(self._width)
        self._line.show(f"[{bar}] {100 * share:3.0f} %, step {step}, {seconds:.4g} s{left}")

    def clear(self) -> None:
        self._line.clear()


def shown(progress: Progress) -> tuple[Optional[Callable[[int, float, float], Any]], Callable[[], None]]:
    """The function that the engine calls, if any, and what is to be called at the end."""
    if callable(progress):
        return progress, lambda: None
    if progress and is_watched():
        bar = Bar()
        return bar, bar.clear
    return None, lambda: None
