#!/usr/bin/env python3
"""What a user has when a call fails, for every n-th call of a short run.

    faults_test.py LAHAR SHIM [--mpiexec MPIEXEC --ranks N] [--calls M] [--only KIND] [--folder F]

Files, memory, threads and MPI fail by the preloaded library SHIM (fault_shim.cpp). Whatever fails,
the run ends in time, with a documented status and a message, or finishes with the same result.
Frames that have their name can be read. After the fault is gone the run goes on from its last
checkpoint, or begins anew, and ends with the same bits. --calls: at most so many of each kind, evenly
spread; 0 = all.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

try:
    import h5py
except ImportError:
    print("skipped: h5py is not installed (python3-h5py)")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
FILE_KINDS = ["open", "write", "write+", "short", "sync", "close", "read", "rename", "truncate", "remove", "folder"]
OTHER_KINDS = ["thread", "new"]
# Of input, step, file and rank (commands.md of the guide); 1 is an internal error and never right.
DOCUMENTED = {2, 3, 4, 5}
SECONDS = 10


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lahar", type=Path)
    parser.add_argument("shim", type=Path)
    parser.add_argument("--mpiexec")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--calls", type=int, default=0)
    parser.add_argument("--only")
    parser.add_argument("--folder", type=Path)
    return parser.parse_args()


class Runs:
    """Runs of the case in a folder of their own."""

    def __init__(self, args, folder):
        self.args = args
        self.folder = folder
        self.case = folder / "jet.json"
        shutil.copy(HERE / "jet.json", self.case)
        self.output = folder / "run"

    def run(self, *options, **faults):
        """Returns status (None: still running after the time), output, seconds."""
        command = [self.args.lahar, "run", self.case, "--threads", "2" if self.args.ranks == 1 else "1",
                   "--output", self.output, *options]
        environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
        for key in [k for k in environment if k.startswith("LAHAR_FAULT")]:
            del environment[key]
        shim = {}
        if faults:
            shim = {"LD_PRELOAD": self.args.shim, "LAHAR_FAULT_UNDER": self.folder, **faults}
        if self.args.ranks > 1:
            exports = [word for key, value in shim.items() for word in ("-x", f"{key}={value}")]
            command = [self.args.mpiexec, "--oversubscribe", "--bind-to", "none", "-n", str(self.args.ranks),
                       *exports, *command]
        else:
            environment |= {key: str(value) for key, value in shim.items()}
        begin = time.monotonic()
        process = subprocess.Popen([str(c) for c in command], env=environment, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, start_new_session=True)
        try:
            out, _ = process.communicate(timeout=6 * SECONDS)
            status = process.returncode
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, 9)
            out, _ = process.communicate()
            status = None
        return status, out.decode(errors="replace"), time.monotonic() - begin

    def counts(self):
        """Largest number of calls of a rank, by kind."""
        file = self.folder / "counts"
        status, out, _ = self.run("--overwrite", LAHAR_FAULT_COUNTS=file)
        assert status == 0, out
        counts = {}
        for line in file.read_text().splitlines():
            kind, n = line.split()
            counts[kind] = max(counts.get(kind, 0), int(n))
        return counts

    def result(self):
        """What a run wrote that has to be equal to the bit."""
        frames = {}
        for file in sorted((self.output / "frames").glob("*.hdf")):
            with h5py.File(file) as frame:
                data = frame["VTKHDF"]
                arrays = {}
                data.visititems(lambda name, item: arrays.__setitem__(name, item[()].tobytes())
                                if isinstance(item, h5py.Dataset) else None)
                frames[file.name] = arrays
        removed = self.output / "removed.csv"
        return frames, (self.output / "history.csv").read_text(), removed.read_text() if removed.exists() else ""


def problems(runs, reference, fault, rank):
    """What is wrong with how a run with this fault ended."""
    shutil.rmtree(runs.output, ignore_errors=True)
    faults = {"LAHAR_FAULT": fault} | ({"LAHAR_FAULT_RANK": rank} if runs.args.ranks > 1 else {})
    status, out, seconds = runs.run(**faults)
    found = []
    if status is None:
        found.append("does not end")
    elif seconds > SECONDS + 20:  # 10 s and what a busy machine takes
        found.append(f"took {seconds:.0f} s")
    if status == 0:
        if runs.result() != reference:
            found.append("says that all is well, but files differ")
        return found, out
    if "MPI_Init" in out:  # nothing of ours has run yet
        return found, out
    if status is not None and status not in DOCUMENTED:
        found.append(f"status {status}")
    if "error" not in out:
        found.append("no message")
    for word in ("internal error", "terminate called", "Segmentation", "corrupt"):
        if word in out:
            found.append(f"says '{word}'")
    for file in (runs.output / "frames").glob("*.hdf"):
        try:
            with h5py.File(file) as frame:
                frame["VTKHDF"].visititems(lambda _, item: item[()] if isinstance(item, h5py.Dataset) else None)
        except Exception as error:  # whatever a reader says
            found.append(f"{file.name} cannot be read: {error}")
    checkpoint = list((runs.output / "checkpoints").glob("checkpoint_*.h5"))
    again, text, _ = runs.run(*(["--restart", "latest"] if checkpoint else ["--overwrite"]))
    if again != 0:
        found.append(f"afterwards, {'restart' if checkpoint else 'run'}: status {again}")
        out += text
    elif runs.result() != reference:
        found.append("afterwards, another result")
    return found, out


def spread(count, most):
    if most <= 0 or count <= most:
        return list(range(1, count + 1))
    return sorted({1 + round(i * (count - 1) / (most - 1)) for i in range(most)})


def main():
    args = arguments()
    args.lahar, args.shim = args.lahar.resolve(), args.shim.resolve()
    folder = (args.folder or Path(tempfile.mkdtemp(prefix="lahar-faults-"))).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    runs = Runs(args, folder)
    counts = runs.counts()
    status, out, _ = runs.run("--overwrite")
    assert status == 0, out
    reference = runs.result()
    kinds = FILE_KINDS + OTHER_KINDS + (["mpi"] if args.ranks > 1 else [])
    bad = done = 0
    for kind in kinds:
        if args.only and kind != args.only:
            continue
        count = counts[kind.rstrip("+")]
        most = args.calls
        if kind == "new":  # a hundred thousand of them, most in libraries
            most = min(args.calls or 300, 300)
        for n in spread(count, most):
            for rank in range(args.ranks):
                fault = f"{kind.rstrip('+')}:{n}" + ("+" if kind.endswith("+") else "")
                found, out = problems(runs, reference, fault, rank)
                done += 1
                if found:
                    bad += 1
                    print(f"{fault} on rank {rank}: {'; '.join(found)}", flush=True)
                    print(re.sub(r"(?m)^", "    ", out[-1500:]), flush=True)
        print(f"{kind}: {count} calls, {len(spread(count, most))} failed on {args.ranks} rank(s)", flush=True)
    print(f"{done} faults, {bad} with problems")
    if not args.folder:
        shutil.rmtree(folder, ignore_errors=True)
    sys.exit(bad > 0)


if __name__ == "__main__":
    main()
