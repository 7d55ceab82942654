"""Runs for conditions_test.py: how they are started, met in the middle, and what is looked at afterwards."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
SECONDS = 10
BUSY = 20  # what a busy machine takes more
STEPS = 500
FINISHED, INPUT, FILE = 0, 2, 4
SERIAL = ("--serial-section", "1ms")  # a thousand steps in a second, at most: time for things to happen


class Process:
    """A run under way."""

    def __init__(self, command, environment, ranks, log):
        self.log, self.ranks, self.begin = log, ranks, time.monotonic()
        with open(log, "w") as out:
            self.process = subprocess.Popen([str(word) for word in command], env=environment, stdout=out,
                                            stderr=subprocess.STDOUT, start_new_session=True)

    def strike(self):
        """The time from which the end is measured."""
        self.begin = time.monotonic()

    def pids(self):
        """Of the ranks."""
        if self.ranks == 1:
            return [self.process.pid]
        found = []
        for stat in Path("/proc").glob("[0-9]*/stat"):
            try:
                fields = stat.read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[1]) == self.process.pid:
                found.append(int(stat.parent.name))
        return sorted(found)

    def end(self):
        """Status (None: it does not end) and what it said."""
        try:
            status = self.process.wait(timeout=SECONDS + BUSY)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
            status = None
        self.seconds = time.monotonic() - self.begin
        return status, self.log.read_text(errors="replace")


class Conditions:
    """Runs, and what is wrong with them."""

    def __init__(self, args, folder):
        self.args, self.folder, self.found, self.name = args, folder, [], ""
        # Of --set, frames are part of a checkpoint's text; all checkpoints are kept, to be compared.
        case = (HERE / "jet.json").read_text()
        case = case.replace('"nsteps": 60', f'"nsteps": {STEPS}').replace(
            '"output_steps": 15, "history_steps": 10, "checkpoint_steps": 20',
            '"output_steps": 20, "history_steps": 10, "checkpoint_steps": 50, "checkpoints_kept": 1000')
        self.case = folder / "jet.json"
        self.case.write_text(case)
        self.output = folder / "run"
        self.whole = folder / "whole"
        counts = folder / "counts"
        status, out = self.run("--output", self.whole, LAHAR_FAULT_COUNTS=counts)
        if status != FINISHED:
            sys.exit(f"the run that is left alone ends with {status}: {out}")
        self.counts = dict(line.split() for line in counts.read_text().splitlines())

    def start(self, *options, ranks=1, threads=None, prefix=(), log="out.txt", **faults):
        environment = {key: value for key, value in os.environ.items() if not key.startswith("LAHAR_FAULT")}
        environment |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        shim = {"LD_PRELOAD": self.args.shim, "LAHAR_FAULT_UNDER": self.folder, **faults} if faults else {}
        if "--output" not in options:
            options = ("--output", self.output, *options)
        threads = threads or (2 if ranks == 1 else 1)
        command = [*prefix, self.args.lahar, "run", self.case, "--threads", threads, *options]
        if ranks > 1:
            exports = [word for key, value in shim.items() for word in ("-x", f"{key}={value}")]
            command = [self.args.mpiexec, "--oversubscribe", "--bind-to", "none", "-n", ranks, *exports, *command]
        else:
            environment |= {key: str(value) for key, value in shim.items()}
        return Process(command, environment, ranks, self.folder / log)

    def run(self, *options, **how):
        return self.start(*options, **how).end()

    def in_the_middle(self, *options, ranks=1, **how):
        """A slowed run that has done two fifths of its steps."""
        shutil.rmtree(self.output, ignore_errors=True)
        process = self.start(*SERIAL, *options, ranks=ranks, **how)
        frame, series = f"particles_{STEPS * 2 // 5 + 20:010}.hdf", self.output / "frames/particles.hdf.series"
        end = time.monotonic() + 60
        while not (series.exists() and frame in series.read_text()):
            if process.process.poll() is not None or time.monotonic() > end:
                sys.exit(f"{self.name}: the run does not get to the middle: {process.log.read_text()}")
            time.sleep(0.002)
        process.strike()
        return process

    # --- what is looked at

    def wrong(self, text, out=""):
        self.found.append(f"{self.name}: {text}")
        print(f"FAILED: {self.name}: {text}\n" + re.sub(r"(?m)^", "    ", out[-1500:]), flush=True)

    def expect(self, process, status, says=""):
        """Waits for the end, which has to be this one."""
        got, out = process.end()
        if got != status:
            self.wrong("does not end" if got is None else f"status {got}, not {status}", out)
        if process.seconds > SECONDS + BUSY:
            self.wrong(f"took {process.seconds:.0f} s", out)
        if not re.search(says, out):
            self.wrong(f"does not say '{says}'", out)
        if status == FILE and "lahar: error: " not in out:
            self.wrong("no message", out)
        for word in ("internal error", "terminate called", "Segmentation", "corrupt", "Aborted"):
            if word in out:
                self.wrong(f"says '{word}'", out)
        return out

    def compare(self, output, finished):
        """Files with those of the run that was left alone; all of them, if it is finished."""
        def files(run):
            return {file.relative_to(run): file.read_bytes()
                    for what in ("frames/particles_*.hdf", "checkpoints/checkpoint_*.h5") for file in run.glob(what)}
        whole, own = files(self.whole), files(output)
        for name in sorted(own):
            if own[name] != whole.get(name):
                self.wrong(f"{name} is not that of the run that was left alone")
        if not finished:
            return
        for name in sorted(whole.keys() - own.keys()):
            self.wrong(f"{name} is missing")
        for name in ("history.csv", "removed.csv", "frames/particles.hdf.series"):
            if not (output / name).exists() or (output / name).read_bytes() != (self.whole / name).read_bytes():
                self.wrong(f"{name} is not that of the run that was left alone")
        if json.loads((output / "manifest.json").read_text())["status"] != "finished":
            self.wrong("the manifest does not say that the run has finished")

    def finish(self, output=None, ranks=1):
        """The run goes on from its checkpoints, and ends as it should."""
        output = output or self.output
        self.compare(output, finished=False)
        process = self.start("--output", output, "--restart", "latest", ranks=ranks)
        self.expect(process, FINISHED, "restart    from step")
        self.compare(output, finished=True)
