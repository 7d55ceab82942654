#!/usr/bin/env python3
"""The tests of the Python package: run.py PACKAGE_FOLDER PROGRAM [TEST...]. Exit code 77: left out."""
import os
import sys
import unittest
from pathlib import Path

package, program, *names = sys.argv[1:]
sys.path[:0] = [package, str(Path(__file__).parent)]
os.environ["PYTHONPATH"] = os.pathsep.join([package, os.environ.get("PYTHONPATH", "")])
os.environ["LAHAR_PROGRAM"] = program
try:
    import lahar  # noqa: F401
    import matplotlib  # noqa: F401
    import pandas  # noqa: F401
except ImportError as missing:
    print(f"Left out: {missing}. The package needs python3-dev and pybind11-dev, its tests python3-pandas and "
          "python3-matplotlib")
    sys.exit(77)
loader = unittest.TestLoader()
tests = loader.loadTestsFromNames(names) if names else loader.discover(str(Path(__file__).parent))
result = unittest.TextTestRunner(verbosity=2).run(tests)
if not result.wasSuccessful():
    sys.exit(1)
sys.exit(77 if len(result.skipped) == result.testsRun else 0)
