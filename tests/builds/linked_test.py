#!/usr/bin/env python3
"""Whether another program can link the engine, and computes what the program does.

    linked_test.py CMAKE BUILD FOLDER
"""
import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path


def main(cmake, build, folder):
    folder, here = Path(folder), Path(__file__).parent
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)

    def run(*command):
        return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True).stdout

    installed = folder / "installed"
    run(cmake, "--install", build, "--component", "development", "--prefix", installed)
    run(cmake, "-G", "Ninja", "-S", here / "linked", "-B", folder / "build", "-DCMAKE_BUILD_TYPE=Release",
        f"-DCMAKE_PREFIX_PATH={installed}")
    run(cmake, "--build", folder / "build")
    case = json.loads((here / "linked" / "case.json").read_text())
    (folder / "case.json").write_text(json.dumps(case))
    kinetic = float(run(folder / "build" / "linked", folder / "case.json"))
    run(Path(build) / "lahar", "run", folder / "case.json", "-o", folder / "run")
    rows = list(csv.DictReader((folder / "run" / "history.csv").open()))
    assert kinetic == float(rows[-1]["kinetic"]) > 0, (kinetic, rows[-1])


if __name__ == "__main__":
    os.environ.setdefault("OMPI_ALLOW_RUN_AS_ROOT", "1")
    main(*sys.argv[1:])
