"""Docstrings of what users meet: the package, its names, and the classes of what these give."""
import inspect
import re
import sys
import unittest

import lahar
from case import TestCase

#: What pybind11 and NamedTuple write where nobody has written anything.
EMPTY = re.compile(r"(\w+\(self: [^\n]*|Alias for field number \d+)?", re.S)


def members(cls):
    """Public methods and properties of a class, of those that are the package's."""
    for base in cls.__mro__:
        if base.__module__.partition(".")[0] != "lahar":
            continue
        for name, value in vars(base).items():
            if not name.startswith("_") and name not in getattr(cls, "_fields", ()):
                function = getattr(value, "fget", None) or getattr(value, "__func__", value)
                if callable(function) or isinstance(value, property):
                    yield name, function, value


def given(function):
    """Classes of the package in what a function is said to return."""
    said = getattr(function, "__annotations__", {}).get("return", "")
    module = vars(sys.modules[function.__module__]) if said else {}
    for word in re.findall(r"[\w.]+", str(said)):
        found = module.get(word.partition(".")[0])
        for name in word.split(".")[1:]:
            found = getattr(found, name, None)
        if inspect.isclass(found) and found.__module__.partition(".")[0] == "lahar":
            yield found


class DocsTest(TestCase):
    def test_every_public_name_has_a_docstring(self):
        waiting = [getattr(lahar, name) for name in lahar.__all__ if not name.startswith("_")]
        told, missing = {}, [] if lahar.__doc__ else ["lahar"]
        while waiting:
            one = waiting.pop()
            if one in told:
                continue
            told[one] = one.__qualname__
            if EMPTY.fullmatch(inspect.cleandoc(one.__doc__ or "")):
                missing.append(one.__qualname__)
            if not inspect.isclass(one):
                waiting += given(one)
                continue
            for name, function, value in members(one):
                told[one, name] = f"{one.__qualname__}.{name}"
                if EMPTY.fullmatch(inspect.cleandoc(value.__doc__ or "")):
                    missing.append(f"{one.__qualname__}.{name}")
                waiting += given(function)
        self.assertEqual(missing, [])
        # Also of what one gets without having its name.
        for name in ("Frames.at", "StudyRun.run", "Patch.used", "Run.warnings", "Study.runs", "Map.plot", "Check"):
            self.assertIn(name, told.values())


if __name__ == "__main__":
    unittest.main()
