#!/usr/bin/env python3
"""The verification book has all cases, its page is what follows from the stored numbers, and cases give them again.

    verification_book_test.py [CASE...]      (default: all cases)
"""
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BOOK = ROOT / "examples" / "verification-book"
PAGE = ROOT / "examples" / "guide" / "pages" / "verification-book.md"
SKIPPED = 77


def run(*arguments):
    done = subprocess.run([sys.executable, BOOK, *arguments], stdout=subprocess.PIPE, text=True)
    print(done.stdout, end="")
    return done


def check_page(names):
    """The page has a section, a figure, numbers and the command of each file of a case."""
    text, failures = PAGE.read_text(encoding="utf-8"), []
    files = {file.stem.replace("_", "-") for file in (ROOT / "examples" / "verification").glob("[!_]*.py")}
    if files != names:
        failures.append(f"--list has {sorted(names)}, the folder {sorted(files)}")
    sections = re.split(r"^## ", text, flags=re.M)[1:]
    for name in files:
        of_it = [section for section in sections if f"examples/verification-book {name}\n" in section]
        if len(of_it) != 1:
            failures.append(f"{len(of_it)} sections of the page are of {name}")
        elif f"(verification-book/{name}.png)" not in of_it[0] or "**Reference.**" not in of_it[0] \
                or "| number | reference | (dt, h) |" not in of_it[0]:
            failures.append(f"the section of {name} has not all of figure, reference and numbers")
    for failure in failures:
        print(f"FAILED: {failure}")
    return not failures


def main():
    names = {line.split()[0] for line in run("--list").stdout.splitlines()}
    complete = check_page(names)
    with tempfile.TemporaryDirectory() as folder:
        status = run("--check", "-o", folder, "--threads", "1", *(sys.argv[1:] or sorted(names))).returncode
    return SKIPPED if status == SKIPPED else int(not complete or status != 0)


if __name__ == "__main__":
    sys.exit(main())
