#!/usr/bin/env python3
"""Who reads frames while a run goes on never meets a part of one.

    live_frames_test.py LAHAR MPIEXEC

A run on one rank, one on two ranks and one that is killed write a frame in each step. Each file is opened with h5py as
soon as it has its name, read whole, and read again when the run is over. Exit status 77: h5py is missing.
"""
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

try:
    import h5py
    import numpy
except ImportError:
    print("skipped: h5py is not installed (python3-h5py)")
    sys.exit(77)

STEPS = 60
PARTICLES = 64_000  # a frame takes long enough to be met half written
LEAST = 10  # frames that have to be met while the run goes on
CASE = {
    "mesh": {"structured": {"cell_size": 0.1, "extent": [2, 2, 2]},
             "boundary_conditions": {"walls": [{"nset": "floor", "normal": [0, 0, 1]}]}},
    "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, 1]}}}},
    "materials": [{"name": "sand", "type": "LinearElastic", "density": 1700, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.3}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "sand",
                                 "region": {"box": {"min": [0, 0, 0], "max": [2, 2, 2]}}}}],
    "external_loading_conditions": {"gravity": [0, 0, -9.81]},
    "analysis": {"dt": 1e-5, "nsteps": STEPS},
    "post_processing": {"output_steps": 1},
}


def read(path):
    """All arrays of a frame, which have to be whole."""
    arrays = {}
    try:
        with h5py.File(path, "r") as file:
            file.visititems(lambda name, node: arrays.update({name: node[()]}) if isinstance(node, h5py.Dataset)
                            else None)
    except OSError as error:
        raise AssertionError(f"{path.name} cannot be read: {error}") from error
    data = {name.rpartition("/")[2]: values for name, values in arrays.items() if "/PointData/" in name}
    step = int(path.stem.rpartition("_")[2])
    assert arrays["VTKHDF/FieldData/step"][0] == step, f"{path.name} is of another step"
    assert {len(values) for values in data.values()} == {PARTICLES}, f"{path.name} has not all particles"
    assert (numpy.sort(data["id"]) == numpy.arange(PARTICLES)).all(), f"{path.name} has not all ids"
    assert (data["mass"] > 0).all() and (data["volume"] > 0).all(), f"{path.name} has particles of nothing"
    for name, values in data.items():
        assert numpy.isfinite(values).all(), f"{path.name}: {name}"
    assert numpy.isfinite(arrays["VTKHDF/Points"]).all() and arrays["VTKHDF/Points"].any(axis=1).all(), path.name
    return arrays


def listed(folder):
    """Files that the index names."""
    try:
        return [folder / one["name"] for one in json.loads((folder / "particles.hdf.series").read_text())["files"]]
    except FileNotFoundError:
        return []


def watch(command, output, kill_after=None):
    """Reads frames while the command runs; returns what was read first, and how many before its end."""
    first, live, in_index = {}, 0, 0
    folder = output / "frames"
    with subprocess.Popen([*command, "-o", output], stdout=subprocess.DEVNULL, start_new_session=True) as run:
        try:
            going = True
            while going:
                going = run.poll() is None  # what was there before the end is met below
                index = listed(folder)
                assert len(index) >= in_index, "the index names fewer frames than before"
                in_index = len(index)
                new = {*folder.glob("particles_*.hdf"), *index} - first.keys()
                for path in sorted(new):
                    first[path] = read(path)
                    live += run.poll() is None
                if kill_after and live >= kill_after:
                    run.kill()
                if not new:
                    time.sleep(0.0005)
        finally:
            if run.poll() is None:
                os.killpg(run.pid, signal.SIGKILL)
    expected = -signal.SIGKILL if kill_after else 0
    assert run.returncode == expected, f"the run ended with {run.returncode}"
    assert live >= LEAST, f"only {live} frames were met before the end of the run"
    for path, before in first.items():
        now = read(path)
        assert now.keys() == before.keys(), path.name
        for name, values in before.items():
            assert values.tobytes() == now[name].tobytes(), f"{path.name}: {name} was another one at first"
    return len(first), live


def main(lahar, mpiexec):
    with tempfile.TemporaryDirectory() as place:
        case = Path(place) / "case.json"
        case.write_text(json.dumps(CASE))
        run = [lahar, "run", case, "-q"]
        ranks = [mpiexec, "--oversubscribe", "--bind-to", "none", "-n", "2"]
        for name, command, kill_after in (("one rank", [*run, "-t", "2"], None),
                                          ("two ranks", [*ranks, *run, "-t", "1"], None),
                                          ("killed", [*run, "-t", "2"], 2 * LEAST)):
            try:
                frames, live = watch(command, Path(place) / name, kill_after)
                assert kill_after or frames == STEPS + 1, f"there are {frames} frames"
            except AssertionError as error:
                print(f"FAILED: {name}: {error}")
                return 1
            print(f"{name}: {frames} frames were whole, {live} of them before the end of the run")
    return 0


if __name__ == "__main__":
    os.environ.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    sys.exit(main(*sys.argv[1:]))
