#!/usr/bin/env python3
"""`pip install .` in an environment of its own gives a package that runs, and can be taken away again.

    install_test.py SOURCE

pip builds as for a user: build/release goes on where it is there. Nothing is downloaded; numpy is the system's. Exit
status 77: this Python makes no environments (Debian: python3-venv).
"""
import os
import subprocess
import sys
import tempfile
from pathlib import Path

# What the Python of the environment runs; the folder is that of case.py.
USE = """
import importlib.metadata
import sys
from pathlib import Path

import lahar

sys.path.append(sys.argv[1])
from case import column

assert Path(lahar.__file__).is_relative_to(sys.prefix), lahar.__file__
assert importlib.metadata.version("lahar") == lahar.__version__.split()[0], lahar.__version__
names = {file.name for file in importlib.metadata.files("lahar")}
assert {"py.typed", "_engine.pyi", "study_worker.py"} <= names, names
case = column(dt=1e-4, end_time=5e-4)
with lahar.Simulation(case) as sim:
    assert sim.step(5) == 5 and sim.finished
    particles = sim.particles
run = case.run("run", progress=False)
assert run.status == "finished" and run.frames[-1].step == 5, run
assert (run.frames[-1]["velocity"] == particles["velocity"]).all() and particles["velocity"].any()
print("five steps with", lahar.__file__)
"""


def call(*command, **options):
    done = subprocess.run(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options)
    if done.returncode != 0:
        sys.exit(f"FAILED: {' '.join(map(str, command[:4]))} ...: status {done.returncode}\n{done.stdout}")
    return done.stdout


def main(source):
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError as missing:
        print(f"skipped: {missing} (Debian: python3-venv)")
        return 77
    # No __pycache__ beside the sources, and no other package of this name.
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    environment.pop("PYTHONPATH", None)
    with tempfile.TemporaryDirectory(prefix="lahar-install-") as place:
        folder = Path(place) / "environment"
        python = folder / "bin" / "python"
        pip = [python, "-m", "pip", "--isolated", "--disable-pip-version-check"]
        call(sys.executable, "-m", "venv", "--system-site-packages", folder, env=environment)
        call(*pip, "install", "--no-index", "--no-build-isolation", source, env=environment)
        print(call(python, "-c", USE, Path(__file__).resolve().parent, cwd=place, env=environment), end="")
        call(*pip, "uninstall", "--yes", "lahar", env=environment)
        left = [str(path) for path in folder.rglob("*lahar*")]
        if left:
            print(f"FAILED: pip uninstall leaves {left}")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
