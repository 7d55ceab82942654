#!/usr/bin/env python3
"""Scenarios that were accepted are valid under the JSON Schema that the program prints.

    schema_test.py LAHAR FUZZ TARGET [--runs N] [--seconds S] [--seed K]

FUZZ TARGET makes scenarios at random and keeps those that the reader accepted. What the schema says of
them otherwise is a defect of one or the other. Exit status 77: there is no validator.
"""

import argparse
import collections
import json
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    from jsonschema import Draft202012Validator
except ImportError:
    print("SKIPPED: there is no validator of JSON Schema (apt-get install python3-jsonschema)")
    sys.exit(77)


def without_comments(text):
    """JSON with // and /* */ comments, as the reader takes it."""
    out, at, in_text = [], 0, False
    while at < len(text):
        if in_text:
            step = 2 if text[at] == "\\" else 1
            in_text = text[at] != '"'
        elif text.startswith("//", at):
            end = text.find("\n", at)
            at = len(text) if end < 0 else end
            continue
        elif text.startswith("/*", at):
            at = text.find("*/", at) + 2
            continue
        else:
            step = 1
            in_text = text[at] == '"'
        out.append(text[at:at + step])
        at += step
    return "".join(out)


def complaints(validator, value):
    """Of alternatives those that come closest, with their places."""
    for error in validator.iter_errors(value):
        while error.context:
            error = max(error.context, key=lambda e: len(e.absolute_path))
        yield "/" + "/".join(map(str, error.absolute_path)), error.message[:150]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lahar")
    parser.add_argument("fuzz")
    parser.add_argument("target")
    parser.add_argument("--runs", default="4000")
    parser.add_argument("--seconds", default="15")
    parser.add_argument("--seed", default="1")
    args = parser.parse_args()
    schema = json.loads(subprocess.run([args.lahar, "info", "--schema"], check=True, capture_output=True).stdout)
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    if not list(complaints(validator, {"mesh": 5, "no such key": 1})):
        print("FAILED: the schema allows anything")
        return 1
    with tempfile.TemporaryDirectory(prefix="lahar-accepted-") as folder:
        # cwd: what fails is written there.
        subprocess.run([Path(args.fuzz).resolve(), args.target, "--runs", args.runs, "--seconds", args.seconds,
                        "--seed", args.seed, "--accepted", folder], check=True)
        files = sorted(Path(folder).glob("*.json"), key=lambda file: int(file.stem))
        found = collections.Counter()
        examples = {}
        for file in files:
            text = file.read_bytes().decode(errors="replace")
            for place, message in complaints(validator, json.loads(without_comments(text))):
                key = "".join("#" if c.isdigit() else c for c in place) + ": " + message
                found[key] += 1
                examples.setdefault(key, text)
    if not files:
        print("FAILED: no scenario was accepted")
        return 1
    for key, count in found.most_common(20):
        print(f"FAILED: {count} times {key}\n  {examples[key][:2000]}")
    print(f"{len(files)} accepted scenarios, {len(found)} kinds of complaints")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
