#!/usr/bin/env python3
"""Command lines at random end as they are documented to.

    command_line_test.py LAHAR [--seconds S] [--runs N] [--seed K]

Subcommands and options are those that `lahar --help` lists, in any order, repeated, cut short or
without their values; values are good and bad ones. Each command line is started in a new folder with
a tiny case. The exit code must be a documented one, 1 only where a comparison or a check may fail; no
signal, no internal error, at most 20 s; no control characters of the command line in what it prints;
nothing written outside of the folder. A failure prints the seed and the smallest command line that
still fails.

Left out, because they are asked to take long or to write anywhere: `bench` that measures (it gets
--list or --from, and no WHAT), `verify` of a case that there is, more than 8 threads, overrides that
make the case longer, absolute paths and .. as output.
"""

import argparse
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SECONDS = 20
DOCUMENTED = {0, 2, 3, 4, 5, 75}
MAY_FAIL = {"compare", "trace"}  # exit code 1: a difference, an unsound trace

CASE = """{"title": "tiny", "mesh": {"structured": {"cell_size": 0.5, "counts": [2, 2]}},
 "particles": [{"generator": {"type": "region", "region": {"box": {"max": [0.5, 0.5]}}, "per_cell": 2,
                              "material": "clay"}}],
 "materials": [{"name": "clay", "type": "LinearElastic", "density": 1800, "youngs_modulus": 1e6, "poisson_ratio": 0.3}],
 "analysis": {"dt": 1e-4, "nsteps": 6}, "post_processing": {"output_steps": 3, "checkpoint_steps": 3}}
"""
DRIVER = """{"material": {"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6, "poisson_ratio": 0.2},
 "path": [{"change": [1e-3, 0, 0, 0, 0, 0], "steps": 5}]}
"""
NETWORK = '{"latency": "2us", "bandwidth": "10GB/s"}\n'

BAD = ["", " ", "0", "-1", "1.5", "nan", "inf", "-inf", "1e999", "99999999999999999999", "-", "--", "---", "=", "a=b",
       "=b", "/=1", "\x1b[31mred\x07", "a\nb\r", "\x7f", "\u202ebackwards", "\u009b31m", b"\xff\xfe", "%s%n%d", "x" * 5000,
       "no-such-file.json", "no/such/folder/file", ".", "case.json/x", "a b", "'", '"', "$(touch x)", "*", "{}", "[]",
       "\u00e9\u4e2d", "latest", "all", "-5:3", "1:2:3", ":", "true", "null"]
INPUT_ONLY = ["/dev/null", "/dev/zero", "/", "/proc/self/mem", ".."]
SETS = ["analysis.nsteps=3", "/analysis/nsteps=2", "analysis.dt=1e-5", "analysis.dt=-1", "title=\x1b[2J", "analysis=null",
        "materials.0.density=-1", "/materials/0/density=\"x\"", "nothing=1", "analysis.nsteps=[1]", "/mesh=", "=3", "a.b.c",
        "analysis.mpm_scheme=\"musl\"", "post_processing.path=\"results\"", "analysis.uuid=\"../up\"", "/~0/~1=2", "[" * 200,
        "analysis.nsteps=" + "[" * 3000]
GOOD = {
    "--set": SETS, "--folder": ["."], "--threads": ["1", "2"], "--balance": ["auto", "off", "2"],
    "--partition": ["curve", "scotch"], "--writers": ["1", "1000000"], "--staging": ["1MiB", "0KiB", "64GiB"],
    "--trace-steps": ["1:3", "0:0", "5:2"], "--inject-latency": ["1us", "0s"], "--slow-patch": ["0:2"],
    "--late-sends": ["0:1us"], "--serial-section": ["1us"], "--output": ["out", "out.csv", "run", "a/b"],
    "--wall-time": ["60", "0.001"], "--restart": ["latest", "run/checkpoints/checkpoint_0000000003.h5"],
    "--checkpoint-steps": ["0", "2"], "--checkpoint-minutes": ["0", "1"], "--memory": ["500M", "1G", "64K"],
    "--ranks": ["1", "3", "1000"], "--to": ["csv", "vtu", "cbgeo"], "--step": ["last", "all", "3", "4"],
    "--rtol": ["1e-6"], "--atol": ["1e-9"], "--floor": ["0"], "--chrome": ["c.json", "c.json.gz"], "--otf2": ["otf2"],
    "--html": ["page.html"], "--replay": ["ideal", "measured", "network.json"], "--json": ["o.json"],
    "--markdown": ["o.md"], "--compare": ["bench.json"], "--from": ["bench.json"], "--cases": ["h8-4k", "none,none"],
    "--repeat": ["1"], "--steps": ["1"], "--field": ["speed", "stress_xy", "none"], "--view": ["3d", "plan", "y=0.2"],
    "--rate": ["5"], "--times": ["2"], "--points": ["500"], "--frames": ["3"], "--every": ["0.1"],
}
POSITIONALS = {"run": ["case.json"], "check": ["case.json"], "graph": ["case.json"], "material": ["driver.json"],
               "trace": ["run"], "export": ["run", "run/frames/particles_0000000003.hdf"],
               "picture": ["run", "run/frames/particles_0000000003.hdf"], "report": ["run"], "watch": ["run"],
               "compare": ["run", "run/frames/particles_0000000003.hdf", "table.csv"], "verify": ["no-such-case"]}
READS = {"--folder", "--restart", "--replay", "--compare", "--from"}
LARGE = {"--threads": "5000", "--ranks": "1000001"}  # beyond what is allowed


class Program:
    """What --help says of it."""

    def __init__(self, lahar):
        self.lahar = lahar
        self.commands = {}
        for name in re.findall(r"^  ([a-z]+)  ", self.help().split("Subcommands:")[1], re.M):
            text = self.help(name)
            found = re.findall(r"^  (?:(-\w),)?(--[\w-]+)( [^ \n]\S*)?", text, re.M)
            # (A long name is alone in its line; a flag's help begins after two spaces.)
            self.commands[name] = [(long, short, bool(value)) for short, long, value in found]
        assert {"run", "check", "trace"} <= set(self.commands), "--help does not list the subcommands"

    def help(self, *command):
        return subprocess.run([self.lahar, *command, "--help"], capture_output=True, text=True, check=True).stdout


def values_of(option, rng):
    if option in GOOD and rng.random() < 0.6:
        return rng.choice(GOOD[option])
    if option in LARGE and rng.random() < 0.2:
        return LARGE[option]
    if option in {"--threads", "--repeat", "--steps", "--cases"}:
        return rng.choice(GOOD[option] + ["0", "-1", "x", ""])
    return rng.choice(BAD + (INPUT_ONLY if option in READS else []))


def one_option(options, rng):
    long, short, takes = rng.choice(options)
    name = short if short and rng.random() < 0.3 else long
    if rng.random() < 0.05:
        name = name[: rng.randrange(1, len(name) + 1)]
    if rng.random() < 0.02:
        name = rng.choice(["--no-such-option", "--\x1b[1m", "-" + "z" * 300, "--set=" * 3, "--help-all", "--version", "-hh"])
    if takes == (rng.random() < 0.04):  # as it should not be
        return [name]
    value = values_of(long, rng)
    if isinstance(value, str) and rng.random() < 0.2:
        return [name + ("=" if name.startswith("--") else "") + value]
    return [name, value]


def command_line(program, rng):
    command = rng.choice(list(program.commands))
    options = program.commands[command]
    parts = [one_option(options, rng) for _ in range(rng.choice([0, 1, 1, 2, 2, 3, 5]))] if options else []
    for _ in range(2 if command == "compare" else 1):
        if command in POSITIONALS and rng.random() < 0.9:
            good = rng.random() < 0.8
            parts.append([rng.choice(POSITIONALS[command] if good else BAD + INPUT_ONLY)])
    if command == "export" and rng.random() < 0.7:
        parts.append(["--to", rng.choice(GOOD["--to"])])
    if rng.random() < 0.03:
        parts.append([rng.choice(BAD)])
    rng.shuffle(parts)
    words = [word for part in parts for word in part]
    if command == "bench":  # never measures: there is no case of that name
        words = [w for w in words if w not in {"ranks", "overlap", "balance", "locate", "trace"}]
        words = rng.choice([["--list"], ["--from", "bench.json"], ["--from", "network.json"]]) + words
    if command in {"run", "graph", "check"} and rng.random() < 0.1:
        words.insert(0, "--")
    if rng.random() < 0.02:
        return words
    if rng.random() < 0.03:
        return [*words, command]
    if rng.random() < 0.02:
        return [command, rng.choice(list(program.commands)), *words]
    return [command, *words]


def usable(words):
    """No argument of a program has a zero byte; words that begin with a dash are its options."""
    return [w if isinstance(w, bytes) else w.encode("utf-8", "surrogateescape") for w in words]


class Attempt:
    """Command lines in folders of their own."""

    def __init__(self, lahar, folder):
        self.lahar = lahar
        self.place = folder / "place"
        self.template = folder / "template"
        self.template.mkdir()
        for name, text in [("case.json", CASE), ("driver.json", DRIVER), ("network.json", NETWORK)]:
            (self.template / name).write_text(text)
        self.environment = {**os.environ, "HOME": str(self.place / "home"), "TMPDIR": str(self.place / "tmp"),
                            "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        for words in (["run", "case.json", "--output", "run", "--trace", "--quiet", "--threads", "2"],
                      ["export", "run", "--to", "csv", "--output", "table.csv"]):
            subprocess.run([lahar, *words], cwd=self.template, check=True, stdout=subprocess.DEVNULL)
        result = {"lahar_bench": 1}
        (self.template / "bench.json").write_text(str(result).replace("'", '"'))

    def problem(self, words):
        """What is wrong, or ''."""
        shutil.rmtree(self.place, ignore_errors=True)
        for name in ("home", "tmp"):
            (self.place / name).mkdir(parents=True)
        work = self.place / "a" / "work"
        shutil.copytree(self.template, work)
        before = self.outside()
        with subprocess.Popen([os.fsencode(self.lahar), *usable(words)], cwd=work, env=self.environment,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            try:
                out, err = process.communicate(timeout=SECONDS)
            except subprocess.TimeoutExpired:
                process.kill()
                return f"is not done after {SECONDS} s"
        code = process.returncode
        if code < 0:
            return f"is ended by signal {-code}"
        said = out + err
        if b"internal error: " in err:
            return "internal error: " + err.decode(errors="replace")[-300:]
        if code not in DOCUMENTED and not (code == 1 and words and words[0] in MAY_FAIL):
            return f"exit code {code}: " + err.decode(errors="replace")[-300:]
        if code in DOCUMENTED - {0, 75} and not err.strip():
            return f"exit code {code} without a message"
        if re.search(rb"[\x00-\x08\x0b-\x1f\x7f]|\xc2[\x80-\x9f]|\xe2\x80[\xaa-\xae]", said):
            return "prints control characters: " + repr(said[-300:])
        if self.outside() != before:
            return "writes outside of its folder: " + ", ".join(sorted(self.outside() - before))
        return ""

    def outside(self):
        """Files that no command line names; Open MPI has its session in TMPDIR while it runs."""
        return {str(p.relative_to(self.place)) for p in self.place.rglob("*")
                if not p.is_relative_to(self.place / "a" / "work") and not str(p).startswith(str(self.place / "tmp" / "ompi"))}

    def smallest(self, words):
        """Leaves out words, and cuts long ones, while it still fails."""
        shorter = True
        while shorter:
            shorter = False
            for k in range(len(words)):
                for replaced in ([], [words[k][: len(words[k]) // 2]]) if len(words[k]) > 8 else ([],):
                    tried = words[:k] + replaced + words[k + 1:]
                    if self.safe(tried) and self.problem(tried):
                        words, shorter = tried, True
                        break
                if shorter:
                    break
        return words

    @staticmethod
    def safe(words):
        """What is left of a benchmark must not measure."""
        return "bench" not in words or "--list" in words or "--from" in words


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lahar", type=Path)
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--runs", type=int, default=0, help="instead of --seconds")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    lahar = str(args.lahar.resolve())
    program = Program(lahar)
    rng = random.Random(args.seed)
    begin = time.monotonic()
    done = 0
    with tempfile.TemporaryDirectory(prefix="lahar-words-") as folder:
        attempt = Attempt(lahar, Path(folder))
        while done < args.runs if args.runs else time.monotonic() - begin < args.seconds:
            words = command_line(program, rng)
            done += 1
            if not attempt.safe(words) or not attempt.problem(words):
                continue
            words = attempt.smallest(words)
            print(f"FAILED: seed {args.seed}, command line {done}\n  lahar " + " ".join(repr(w) for w in words))
            print("  " + attempt.problem(words))
            return 1
    print(f"{done} command lines in {time.monotonic() - begin:.0f} s, seed {args.seed}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
