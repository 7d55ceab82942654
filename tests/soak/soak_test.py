#!/usr/bin/env python3
"""Whether a run that goes on for long stays as it is, and what it leaves behind.

    soak_test.py LAHAR [--mpiexec MPIEXEC] [--seconds S] [--folder F]

Water flows through a channel (channel.json): as many particles come as leave. Three runs at the same time, S seconds
each: "one", one rank with frames, checkpoints, and tracing at the beginning; "two", the same on two ranks of
which patches move (--balance); "bare", one rank that writes nothing but history.csv. (Without --mpiexec no "two".)
Every process is looked at ten times a second, at most 2000 times. Flat means, after the first third of the samples, in
which patches are made and split:

- the number of particles is stationary: the means of the second and of the last third differ by less than 10 %;
- memory (VmRSS): a straight line through the samples rises by less than 2 % of their mean, or 0.5 MiB, whichever is
  more (4 MiB more in runs of less than a minute: that long, threads, MPI and patches that move take what they need).
  What is kept for each step, and be it a few bytes, rises more in half an hour;
- address space (VmData): its largest value in the last third is at most 8 MiB above that of the second third;
- threads and segments of shared memory: the largest number in the last third is at most that of the second third, and
  one more. Threads that write come and go.
- descriptors: the same of the smallest number. Files are open for moments only; what leaks is open in every sample.

The folder of a run has at most checkpoints_kept + 1 checkpoints and max_frames + 2 frames, whenever one looks.

Then runs end: by themselves, by SIGTERM, SIGINT and SIGKILL, of a rank and of mpirun. Status and time are as
documented, and nothing is left in /dev/shm and $TMPDIR, which are folders of the test's own. One exception: when
mpirun itself is killed, Open MPI's session folder (ompi.*) and its segments stay; they are not Lahar's.
"""

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
sys.dont_write_bytecode = True  # beside the sources
import mount_namespace  # noqa: E402

SECONDS_TO_END = 10


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lahar", type=Path)
    parser.add_argument("--mpiexec")
    parser.add_argument("--seconds", type=float, default=8)
    parser.add_argument("--folder", type=Path)
    return parser.parse_args()


class Run:
    """A run of the channel in a folder of its own."""

    def __init__(self, args, folder, name, ranks, *options):
        self.name, self.output, self.temporary = name, folder / name, folder / f"tmp-{name}"
        self.temporary.mkdir()
        self.log = folder / f"{name}.txt"
        command = [args.lahar.resolve(), "run", HERE / "channel.json", "--threads", "2" if ranks == 1 else "1",
                   "--output", self.output, *options]
        if ranks > 1:
            command = [args.mpiexec, "--oversubscribe", "--bind-to", "none", "-n", ranks, *command]
        environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                           TMPDIR=str(self.temporary))
        with open(self.log, "w") as log:
            self.process = subprocess.Popen([str(word) for word in command], env=environment, stdout=log,
                                            stderr=subprocess.STDOUT)
        self.ranks = ranks
        self.samples = {}

    def pids(self):
        """Of the ranks."""
        if self.ranks == 1:
            return [self.process.pid]
        found = []
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[1]) == self.process.pid and fields[0] not in "ZX":
                found.append(int(folder.name))
        return sorted(found)

    def wait_until_running(self):
        end = time.monotonic() + 60
        while time.monotonic() < end:
            history = self.output / "history.csv"
            if history.exists() and history.read_text().count("\n") > 3 and len(self.pids()) == self.ranks:
                return
            time.sleep(0.02)
        sys.exit(f"{self.name} does not begin: {self.log.read_text()}")

    def sample(self):
        for pid in self.pids():
            proc = Path(f"/proc/{pid}")
            try:
                status = dict(line.split(":", 1) for line in (proc / "status").read_text().splitlines())
                shared = {line.split(None, 5)[5] for line in (proc / "maps").read_text().splitlines()
                          if "memfd:" in line or "/dev/shm/" in line}
                self.samples.setdefault(pid, []).append({
                    "VmRSS": int(status["VmRSS"].split()[0]), "VmData": int(status["VmData"].split()[0]),
                    "descriptors": len(list((proc / "fd").iterdir())), "threads": int(status["Threads"]),
                    "segments": len(shared)})
            except (OSError, KeyError):  # it is ending
                continue

    def files_too_many(self, kept, frames):
        count = [len(list((self.output / where).glob(what)))
                 for where, what in (("checkpoints", "checkpoint_*.h5"), ("frames", "particles_*.hdf"))]
        if count[0] > kept + 1 or count[1] > frames + 2:
            return [f"{count[0]} checkpoints and {count[1]} frames"]
        return []

    def end(self, number, pid=None):
        """Sends a signal; returns status and seconds."""
        begin = time.monotonic()
        os.kill(pid or self.process.pid, number)
        return self.process.wait(timeout=120), time.monotonic() - begin

    def left(self, with_mpi=False):
        """What there is in $TMPDIR, and in /dev/shm if that is ours."""
        found = [str(file.relative_to(self.temporary)) for file in self.temporary.iterdir()]
        if mount_namespace.MARK in os.environ:
            found += [f"/dev/shm/{name}" for name in os.listdir("/dev/shm")]
        if with_mpi:  # Open MPI's own, of an mpirun that could not clean up
            found = [name for name in found if not name.startswith(("ompi.", "/dev/shm/vader_segment.",
                                                                    "/dev/shm/sm_segment."))]
        return found


def rise(values):
    """Of the straight line through values at equal distances."""
    n = len(values)
    middle, mean = (n - 1) / 2, sum(values) / n
    slope = sum((i - middle) * (v - mean) for i, v in enumerate(values)) / sum((i - middle) ** 2 for i in range(n))
    return slope * (n - 1)


def thirds(values):
    n = len(values)
    return values[n // 3:2 * n // 3], values[2 * n // 3:]


def problems_of(run, seconds):
    """What is not flat."""
    found = []
    rows = [line.split(",") for line in (run.output / "history.csv").read_text().splitlines()[1:]]
    particles = [int(row[3]) for row in rows]
    before, after = (sum(part) / len(part) for part in thirds(particles))
    print(f"{run.name}: {rows[-1][0]} steps, particles {before:.0f}, then {after:.0f}")
    if abs(after - before) > 0.1 * before:
        found.append(f"{before:.0f} particles have become {after:.0f}: this says nothing of memory")
    if len(run.samples) != run.ranks:
        found.append(f"{len(run.samples)} processes were seen, not {run.ranks}")
    for pid, samples in run.samples.items():
        rss = [s["VmRSS"] for s in samples][len(samples) // 3:]
        mean, rises = sum(rss) / len(rss), rise(rss)
        most = {key: tuple((min if key == "descriptors" else max)(s[key] for s in part) for part in thirds(samples))
                for key in ("VmData", "descriptors", "threads", "segments")}
        print(f"  process {pid}: {len(samples)} samples, VmRSS {mean / 1024:.2f} MiB, rises by {rises:.0f} KiB "
              f"({100 * rises / mean:.2f} %); " + ", ".join(f"{key} {a} then {b}" for key, (a, b) in most.items()),
              flush=True)
        warm_up = 4096 if seconds < 60 else 0
        if rises > max(0.02 * mean, 512) + warm_up:
            found.append(f"memory of process {pid} rises by {rises:.0f} KiB")
        for key, (before, after) in most.items():
            if after > before + (8192 if key == "VmData" else 1):
                found.append(f"{key} of process {pid}: {before}, then {after}")
    return found


def soak(args, folder):
    """Runs for so many seconds; returns what is wrong."""
    bare = ("--set", "post_processing.output_steps=0", "--set", "post_processing.checkpoint_steps=0")
    limits = {"kept": 2, "frames": 10_000}
    # Traces are bounded so, and buffers of a MiB per thread are there before memory is looked at.
    runs = [Run(args, folder, "one", 1, "--trace", "--trace-steps", "200:800"),
            Run(args, folder, "bare", 1, *bare)]
    if args.mpiexec:
        runs.append(Run(args, folder, "two", 2, "--balance", "100", "--trace", "--trace-steps", "100:500"))
    for run in runs:
        run.wait_until_running()
    found = []
    begin = time.monotonic()
    while time.monotonic() < begin + args.seconds:
        for run in runs:
            run.sample()
            found += run.files_too_many(**limits)
            if run.process.poll() is not None:
                sys.exit(f"{run.name} ended with {run.process.returncode}: {run.log.read_text()}")
        time.sleep(max(0.1, args.seconds / 2000))
    for run in runs:
        # mpirun kills ranks a second after SIGTERM and has a status of its own: the ranks get it.
        for pid in run.pids():
            os.kill(pid, signal.SIGTERM)
        status = run.process.wait(timeout=120)
        if status != 75:
            found.append(f"{run.name} ended with {status}: {run.log.read_text()[-1500:]}")
    for run in runs:
        if run.left():
            found.append(f"{run.name} left {run.left()}")
        found += problems_of(run, args.seconds)
        size = sum(file.stat().st_size for file in run.output.rglob("*") if file.is_file())
        print(f"  folder: {size / 1e6:.1f} MB, of which removed.csv "
              f"{(run.output / 'removed.csv').stat().st_size / 1e6:.1f} MB")
    return found


def ends(args, folder):
    """Ends runs in all ways; returns what is wrong."""
    found = []

    def check(run, how, status, seconds, expected, with_mpi=False):
        if status not in expected:
            found.append(f"{how}: status {status}: {run.log.read_text()[-1500:]}")
        if seconds > SECONDS_TO_END + 10:  # on a busy machine
            found.append(f"{how}: took {seconds:.0f} s")
        end = time.monotonic() + SECONDS_TO_END
        while time.monotonic() < end and run.left(with_mpi):  # ranks may still be ending
            time.sleep(0.1)
        if run.left(with_mpi):
            found.append(f"{how}: left {run.left(with_mpi)}")
        print(f"{how}: status {status}, {seconds:.1f} s", flush=True)
        for file in os.listdir("/dev/shm") if mount_namespace.MARK in os.environ else []:
            os.unlink(f"/dev/shm/{file}")
        shutil.rmtree(run.output)

    for ranks in [1, 2] if args.mpiexec else [1]:
        at = f"{ranks} rank(s)"
        limited = ("--set", "analysis.nsteps=300", "--set", "post_processing.max_frames=5",
                   "--set", "post_processing.output_steps=10", "--checkpoint-steps", "20")
        run = Run(args, folder, f"whole-{ranks}", ranks, *limited)
        status = run.process.wait(timeout=120)
        found += run.files_too_many(kept=1, frames=5)
        check(run, f"{at}, the end", status, 0, [0])
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGKILL):
            run = Run(args, folder, f"{number.name}-{ranks}", ranks)
            run.wait_until_running()
            pid = run.pids()[-1]
            status, seconds = run.end(number, pid)
            # mpirun says 137 of a rank that was killed; the other one may be faster, with 5.
            killed = [-9] if ranks == 1 else [137, 5]
            check(run, f"{at}, {number.name}", status, seconds, killed if number == signal.SIGKILL else [75])
        if ranks > 1:
            run = Run(args, folder, "mpirun", ranks)
            run.wait_until_running()
            pids = run.pids()
            status, seconds = run.end(signal.SIGKILL)
            end = time.monotonic() + SECONDS_TO_END
            while time.monotonic() < end and any(Path(f"/proc/{pid}/exe").exists() for pid in pids):
                time.sleep(0.1)
            alive = [pid for pid in pids if os.path.exists(f"/proc/{pid}/exe")]
            if alive:
                found.append(f"mpirun was killed, and ranks live on: {alive}")
                for pid in alive:
                    os.kill(pid, signal.SIGKILL)
            check(run, f"{at}, SIGKILL of mpirun", status, seconds, [-9], with_mpi=True)
    return found


def main():
    args = arguments()
    if not mount_namespace.enter("mount -t tmpfs none /dev/shm"):
        print("no mount namespaces here: /dev/shm is not looked at")
    folder = (args.folder or Path(tempfile.mkdtemp(prefix="lahar-soak-"))).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    try:
        found = soak(args, folder) + ends(args, folder)
    finally:
        if not args.folder:
            shutil.rmtree(folder, ignore_errors=True)
    for problem in found:
        print(f"FAILED: {problem}")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
