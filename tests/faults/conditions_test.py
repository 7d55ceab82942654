#!/usr/bin/env python3
"""What a user has when the system around a run changes: disks, limits, clocks, other runs, stopped processes.

    conditions_test.py LAHAR SHIM [--mpiexec MPIEXEC --ranks 2] [--only WORD] [--folder F]

Each condition meets a run of jet.json in the middle, on one rank or, where that differs, on several. A run that cannot
go on ends within 10 s of it, with the documented status and a message; every frame and checkpoint that has its name is,
to the bit, that of a run that was left alone; and when the condition is over, --restart latest ends with the same
frames, history and removed particles. A run that can go on ends with these at once. What needs mounts is left out where
the system does not allow a mount namespace. SHIM is the library of fault_shim.cpp.
"""

import argparse
import errno
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from datetime import datetime, timedelta
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
sys.dont_write_bytecode = True  # beside the sources
import mount_namespace  # noqa: E402
from condition_runs import FILE, FINISHED, INPUT, SERIAL, Conditions  # noqa: E402


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lahar", type=Path)
    parser.add_argument("shim", type=Path)
    parser.add_argument("--mpiexec")
    parser.add_argument("--ranks", type=int, default=1, help="1, or 2 and more: what is done on several ranks")
    parser.add_argument("--only", default="")
    parser.add_argument("--folder", type=Path)
    return parser.parse_args()


def mount(*words):
    subprocess.run(["mount", *map(str, words)], check=True)


def unmount(place):
    subprocess.run(["umount", "-l", str(place)], check=True)


# --- the conditions ---------------------------------------------------------------------------------


def disk_full(test, ranks):
    """A small disk fills up; then there is more of it."""
    size = sum(file.stat().st_blocks * 512 for file in test.whole.rglob("*"))
    shutil.rmtree(test.output, ignore_errors=True)
    test.output.mkdir()
    mount("-t", "tmpfs", "-o", f"size={size * 6 // 10 // 1024}k", "none", test.output)
    try:
        test.expect(test.start(ranks=ranks), FILE, "No space left on device.*--restart latest goes on from step")
        mount("-o", f"remount,size={2 * size}", test.output)
        test.finish(ranks=ranks)
    finally:
        unmount(test.output)


def file_size_limit(test, ranks):
    """ulimit -f while the run is on its way."""
    process = test.in_the_middle(ranks=ranks)
    for pid in process.pids():
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (8192, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
    test.expect(process, FILE, "File too large.*--restart latest goes on from step")
    test.finish(ranks=ranks)


def file_size_limit_from_the_start(test, ranks):
    """And when it begins, of a file that cannot even hold the first frame."""
    shutil.rmtree(test.output, ignore_errors=True)
    limit = ["prlimit", "--fsize=8192"]
    test.expect(test.start(prefix=limit, ranks=ranks), FILE, "cannot write .*: File too large")
    test.expect(test.start("--overwrite", ranks=ranks), FINISHED)
    test.compare(test.output, finished=True)


def by_shim(test, ranks, number, kinds):
    """Calls of these kinds give the same error number from the middle of the run on."""
    for kind in kinds:
        test.name += f", {kind}"
        shutil.rmtree(test.output, ignore_errors=True)
        # Of two ranks each makes fewer calls than one alone.
        at = int(test.counts[kind]) * (2 if ranks == 1 else 1) // 4 + 1
        process = test.start(ranks=ranks, LAHAR_FAULT=f"{kind}:{at}+", LAHAR_FAULT_ERRNO=number)
        test.expect(process, FILE, os.strerror(number))
        test.finish(ranks=ranks)


def quota(test, ranks):
    """The user's share of the disk is used up."""
    by_shim(test, ranks, errno.EDQUOT, ["write"])


def stale_handle(test, ranks):
    """A file server has forgotten what was open."""
    by_shim(test, ranks, errno.ESTALE, ["open", "write", "sync", "close", "rename"] if ranks == 1 else ["write"])


def read_only_by_error(test, ranks):
    """A disk with errors, which the system makes read-only: open files, too."""
    by_shim(test, ranks, errno.EROFS, ["write", "open"])


def read_only_at_the_start(test, ranks):
    """Where the run folder should be made."""
    place = test.folder / "read-only"
    place.mkdir(exist_ok=True)
    mount("-t", "tmpfs", "-o", "ro", "none", place)
    try:
        test.expect(test.start("--output", place / "run", ranks=ranks), FILE, "cannot make folder .*Read-only")
    finally:
        unmount(place)


def remount_read_only(folder):
    """The kernel refuses it while a file is open for writing, as one of the run may be for a moment."""
    for attempt in range(100):
        try:
            return mount("-o", "remount,bind,ro", folder)
        except subprocess.CalledProcessError:
            if attempt == 99:
                raise
            time.sleep(0.02)


def read_only_in_the_middle(test, ranks):
    """The run folder becomes read-only for everything that is opened."""
    process = test.in_the_middle(ranks=ranks)
    mount("--bind", test.output, test.output)
    try:
        remount_read_only(test.output)
        process.strike()
        test.expect(process, FILE, "Read-only file system.*--restart latest goes on from step")
        for options in (["--restart", "latest"], ["--overwrite"]) if ranks == 1 else []:
            test.expect(test.start(*options, ranks=ranks), FILE, "cannot write .*Read-only file system")
    finally:
        unmount(test.output)
    test.finish(ranks=ranks)


def folder_removed(test, ranks):
    """All of a run is deleted while it goes on; nothing may pretend to be its results."""
    process = test.in_the_middle(ranks=ranks)
    gone = test.folder / "gone"
    test.output.rename(gone)  # in one go, which rm -r does not do
    shutil.rmtree(gone)
    test.expect(process, FILE, "error: .*run")
    if test.output.exists():
        test.wrong(f"makes its folder anew: {sorted(p.name for p in test.output.rglob('*'))}")
    test.expect(test.start("--restart", "latest"), INPUT, "holds no (run|checkpoint)")
    test.expect(test.start(ranks=ranks), FINISHED)
    test.compare(test.output, finished=True)


def folder_emptied(test, ranks):
    """rm -r in a race with the run: its folders are made again, its log is not there."""
    process = test.in_the_middle(ranks=ranks)
    for file in test.output.iterdir():
        if file.is_file():
            file.unlink()
    for folder in ("frames", "checkpoints"):
        for file in (test.output / folder).iterdir():
            file.unlink(missing_ok=True)
    test.expect(process, FILE, "was removed, moved or replaced while this run wrote to it")
    if (test.output / "manifest.json").exists():
        test.wrong("writes a manifest where its results are not")


def folder_replaced(test, ranks):
    """A run's folder is moved away and that of another run takes its place: neither run touches what is the other's."""
    other, moved = test.folder / "other", test.folder / "moved"
    for folder in (other, moved):
        shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(test.whole, other)
    for file in (other / "frames").iterdir():
        file.write_text("mine")
    before = {file.relative_to(other): file.read_bytes() for file in other.rglob("*") if file.is_file()}
    process = test.in_the_middle(ranks=ranks)
    test.output.rename(moved)
    other.rename(test.output)
    test.expect(process, FILE, "was removed, moved or replaced while this run wrote to it|No such file")
    after = {file.relative_to(test.output): file.read_bytes() for file in test.output.rglob("*") if file.is_file()}
    changed = sorted(str(name) for name in before.keys() | after.keys() if before.get(name) != after.get(name))
    if changed:
        test.wrong(f"of the other run, {', '.join(changed)} are changed")
    test.finish(output=moved, ranks=ranks)


def two_runs(test, ranks):
    """Of two that begin at the same time in one folder, one is refused."""
    for _ in range(3):
        shutil.rmtree(test.output, ignore_errors=True)
        both = [test.start(*SERIAL, ranks=ranks, log=f"out{k}.txt") for k in range(2)]
        ends = [process.end() for process in both]
        if sorted(status for status, _ in ends) != [FINISHED, INPUT]:
            test.wrong(f"ended with {[status for status, _ in ends]}", ends[0][1] + ends[1][1])
        for status, out in ends:
            if status == INPUT and "is being written to by another run" not in out:
                test.wrong("the second run is refused for another reason", out)
        test.compare(test.output, finished=True)


def second_run(test, ranks):
    """One that comes later is refused whatever it wants, and does not disturb the first, which waits meanwhile."""
    process = test.in_the_middle(ranks=ranks)
    for pid in process.pids():
        os.kill(pid, signal.SIGSTOP)
    try:
        for options in ([], ["--overwrite"], ["--restart", "latest"]):
            test.expect(test.start(*options, ranks=ranks, log="other.txt"), INPUT, "is being written to by another run")
    finally:
        for pid in process.pids():
            os.kill(pid, signal.SIGCONT)
    process.strike()
    test.expect(process, FINISHED)
    test.compare(test.output, finished=True)


def clock_jumps(test, ranks):
    """The wall clock is five hours ahead, then behind; checkpoints by minutes come as if nothing were."""
    shutil.rmtree(test.output, ignore_errors=True)
    minutes = ("--checkpoint-minutes", "0.002", "--checkpoint-steps", "0", "--set",
               "post_processing.checkpoint_steps=0", "--trace")
    process = test.start(*SERIAL, *minutes, ranks=ranks, LAHAR_FAULT_CLOCK=18000)
    out = test.expect(process, FINISHED)
    number = len(list((test.output / "checkpoints").glob("checkpoint_*.h5")))
    if not 2 <= number <= process.seconds / 0.12 + 2:
        test.wrong(f"{number} checkpoints in {process.seconds:.1f} s, one each 0.12 s", out)
    # The state is the same; text of the scenario in a checkpoint says how often they come.
    shutil.rmtree(test.output / "checkpoints")
    shutil.copytree(test.whole / "checkpoints", test.output / "checkpoints")
    test.compare(test.output, finished=True)
    manifest = json.loads((test.output / "manifest.json").read_text())
    if abs(datetime.fromisoformat(manifest["started"].rstrip("Z")) - datetime.utcnow()) < timedelta(hours=4):
        test.wrong(f"the clock of the run is right: {manifest['started']}")
    if not 0 < manifest["wall_seconds"] <= process.seconds:
        test.wrong(f"the manifest says {manifest['wall_seconds']} s of {process.seconds:.1f} s")
    if re.search(r"-[0-9.]+ (s|min|h)\b| [0-9]+ h [0-9]", out):
        test.wrong("a time that cannot be", out)
    trace = subprocess.run([test.args.lahar, "trace", test.output, "--check"], capture_output=True, text=True)
    if trace.returncode != 0:
        test.wrong("the trace is not sound", trace.stdout + trace.stderr)


def stopped_process(test, ranks):
    """SIGSTOP of a run, or of one of its ranks, and SIGCONT some seconds later."""
    process = test.in_the_middle(ranks=ranks)
    pid = process.pids()[-1]
    os.kill(pid, signal.SIGSTOP)
    time.sleep(2)
    os.kill(pid, signal.SIGCONT)
    process.strike()
    test.expect(process, FINISHED)
    test.compare(test.output, finished=True)


def oversubscribed(test, _):
    """Eight ranks of two threads, on as few cores as there are."""
    shutil.rmtree(test.output, ignore_errors=True)
    process = test.start(ranks=8, threads=2)
    status, out = process.end()  # how long it takes is the machine's affair
    if status != FINISHED:
        test.wrong(f"status {status}", out)
    else:
        test.compare(test.output, finished=True)


CONDITIONS = [  # what, on how many ranks, needs mounts
    (disk_full, (1, 2), True),
    (file_size_limit, (1, 2), False),
    (file_size_limit_from_the_start, (1,), False),
    (quota, (1, 2), False),
    (stale_handle, (1, 2), False),
    (read_only_by_error, (1,), False),
    (read_only_at_the_start, (1, 2), True),
    (read_only_in_the_middle, (1, 2), True),
    (folder_removed, (1, 2), False),
    (folder_emptied, (1,), False),
    (folder_replaced, (1, 2), False),
    (two_runs, (1,), False),
    (second_run, (1,), False),
    (clock_jumps, (1, 2), False),
    (stopped_process, (1, 2), False),
    (oversubscribed, (8,), False),
]


def main():
    mounts = mount_namespace.enter()
    args = arguments()
    args.lahar, args.shim = args.lahar.resolve(), args.shim.resolve()
    folder = (args.folder or Path(tempfile.mkdtemp(prefix="lahar-conditions-"))).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    try:
        test = Conditions(args, folder)
        done = 0
        for condition, of_ranks, needs_mounts in CONDITIONS:
            for ranks in of_ranks:
                test.name = f"{condition.__name__} on {ranks} rank(s)"
                if args.only not in test.name or (ranks > 1) != (args.ranks > 1):
                    continue
                if needs_mounts and not mounts:
                    print(f"left out, as the system allows no mounts: {test.name}")
                    continue
                begin, name = time.monotonic(), test.name
                condition(test, ranks)
                done += 1
                print(f"{name}: {time.monotonic() - begin:.1f} s", flush=True)
        print(f"{done} conditions, {len(test.found)} problems")
    finally:
        if not args.folder:
            shutil.rmtree(folder, ignore_errors=True)
    sys.exit(bool(test.found) or done == 0)


if __name__ == "__main__":
    main()
