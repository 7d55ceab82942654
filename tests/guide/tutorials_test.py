#!/usr/bin/env python3
"""Run what the tutorials of the guide say, and compare it with what they say comes out.

    tutorials_test.py PROGRAM [PAGE...] [--pictures]

A tutorial is one folder and one shell. Of its fenced blocks

    ```jsonc title="a.json"               is written to the file a.json (any language but sh, any name)
    ```sh                                 is run; all commands have to succeed
    ```sh title="ends with status 2"      is run; the last command ends with this status
    ```text title="it prints"             is what the block before printed: words are equal, numbers
                                          equal to 2 % or to two units of their last digit; `...` stands
                                          for any lines, or for any words of a line
    ```text title="it prints, to 5 %"     the same, with 5 % in place of 2 %
    ```console                            is not run: it needs what a test has not, such as a cluster

Pictures of a page are made by its commands. They have to look like those that are stored beside it;
--pictures stores new ones. The gallery is run as a tutorial is.
"""
import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ROOT / "examples" / "guide" / "pages"
FENCE = re.compile(r'^```(\w+)(?: title="([^"]*)")?\n(.*?)^```$', re.M | re.S)
PICTURE = re.compile(r"!\[[^\]]*\]\(((?:gallery/)?[\w.-]+\.png)\)")
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
TOLERANCE = 0.02  # other vector widths round otherwise, and flows of grains feel it
LAST_DIGITS = 2
# Pictures are compared by the means of tiles: text and single particles may differ.
TILES, COLOUR_TOLERANCE = 12, 12  # per side; of 255
LARGEST_PICTURE = 150_000  # bytes
LARGEST_WIDTH, LARGEST_HEIGHT = 900, 640


class Wrong(Exception):
    """A tutorial does not do what it says."""


def tail(output):
    return "\n".join(output.splitlines()[-30:])


def same_number(expected, found, tolerance):
    digits = len(expected.partition(".")[2].lower().partition("e")[0])
    unit = 10.0 ** -digits
    if "e" in expected.lower():
        unit *= 10.0 ** int(expected.lower().partition("e")[2])
    wanted = float(expected)
    return abs(float(found) - wanted) <= max(tolerance * abs(wanted), LAST_DIGITS * unit)


def pattern_of(line):
    """Words as they are, numbers as groups, `...` as anything."""
    parts = []
    for part in line.strip().split("..."):
        pieces = NUMBER.split(part)
        parts.append(f"({NUMBER.pattern})".join(r"\s+".join(map(re.escape, re.split(r"\s+", piece)))
                                               for piece in pieces))
    return ".*".join(parts)


def same_line(expected, found, tolerance):
    match = re.fullmatch(pattern_of(expected), found.strip())
    return bool(match) and all(same_number(wanted, number, tolerance) for wanted, number in
                               zip(NUMBER.findall(expected), match.groups()))


def check_output(expected, found, tolerance):
    lines = [line for line in found.splitlines() if line.strip()]
    at, anywhere = 0, False
    for wanted in (line for line in expected.splitlines() if line.strip()):
        if wanted.strip() == "...":
            anywhere = True
            continue
        hits = [i for i in range(at, len(lines)) if same_line(wanted, lines[i], tolerance)]
        if not hits or (hits[0] != at and not anywhere):
            raise Wrong(f"the page says it prints\n    {wanted}\nand found was\n" + tail(found))
        at, anywhere = hits[0] + 1, False
    if at < len(lines) and not anywhere:
        raise Wrong("the page does not say that it prints\n" + "\n".join(lines[at:]))


def environment(program, folder):
    (folder / "bin").mkdir()
    (folder / "bin" / "lahar").symlink_to(program)
    (folder / "bin" / "plot.py").symlink_to(ROOT / "examples" / "plot.py")
    (folder / "examples").symlink_to(ROOT / "examples")
    return {**os.environ, "PATH": f"{folder / 'bin'}:/usr/bin:{os.environ['PATH']}",
            "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
            "OMPI_MCA_rmaps_base_oversubscribe": "1"}


def run_block(script, status, folder, env):
    done = subprocess.run(["bash", "-e", "-c", script], cwd=folder, env=env, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=600)
    if done.returncode != status:
        raise Wrong(f"ended with status {done.returncode}, not {status}:\n{script}\n{tail(done.stdout)}")
    return done.stdout


def stored_size(picture):
    """The size in which a picture is stored. Large pictures are made smaller."""
    scale = min(1, LARGEST_WIDTH / picture.width, LARGEST_HEIGHT / picture.height)
    return round(picture.width * scale), round(picture.height * scale)


def tiles(path):
    from PIL import Image
    with Image.open(path) as picture:
        return stored_size(picture), list(picture.convert("RGB").resize((TILES, TILES), Image.BOX).getdata())


def check_picture(made, stored):
    if not stored.exists():
        raise Wrong(f"{stored.name} is not stored: tutorials_test.py --pictures stores it")
    if stored.stat().st_size > LARGEST_PICTURE:
        raise Wrong(f"{stored.name} has {stored.stat().st_size} bytes; {LARGEST_PICTURE} are allowed")
    (size, new), (old_size, old) = tiles(made), tiles(stored)
    if any(abs(a - b) > 0.05 * b for a, b in zip(size, old_size)):
        raise Wrong(f"{stored.name} is {old_size} pixels, and the commands make {size}")
    worst = max(abs(a - b) for p, q in zip(new, old) for a, b in zip(p, q))
    if worst > COLOUR_TOLERANCE:
        raise Wrong(f"{stored.name} is not what the commands make: colours differ by {worst}")


def store_picture(made, stored):
    from PIL import Image
    with Image.open(made) as picture:
        small = picture.convert("RGB").resize(stored_size(picture), Image.LANCZOS)
        for colours in (128, 64, 32, 16):
            small.quantize(colours, dither=Image.Dither.NONE).save(stored, optimize=True)
            if stored.stat().st_size < LARGEST_PICTURE:
                break


def run_page(page, program, store):
    text = page.read_text(encoding="utf-8")
    commands = 0
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        env = environment(program, folder)
        output = ""
        for language, title, body in FENCE.findall(text):
            if language == "sh":
                status = int(title.split()[-1]) if title.startswith("ends with status") else 0
                output = run_block(body, status, folder, env)
                commands += 1
            elif title.startswith("it prints"):
                percent = re.search(r"to (\d+) %", title)
                check_output(body, output, int(percent.group(1)) / 100 if percent else TOLERANCE)
            elif title:
                (folder / title).parent.mkdir(parents=True, exist_ok=True)
                (folder / title).write_text(body, encoding="utf-8")
        wrong = []
        for name in PICTURE.findall(text):
            try:
                if not (folder / name).exists():
                    raise Wrong(f"no command makes the picture {name}")
                if store:
                    store_picture(folder / name, page.parent / name)
                else:
                    # As it would be stored, so that sizes agree.
                    store_picture(folder / name, folder / "stored.png")
                    check_picture(folder / "stored.png", page.parent / name)
            except Wrong as error:  # one picture does not hide the next
                wrong.append(str(error))
        if wrong:
            raise Wrong("\n  ".join(wrong))
    if not commands:
        raise Wrong("has no commands")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("pages", nargs="*", help="such as consolidation (default: all)")
    parser.add_argument("--pictures", action="store_true", help="store the pictures")
    arguments = parser.parse_args()
    needs = "import numpy, h5py, matplotlib, PIL"
    for python in {sys.executable, shutil.which("python3", path="/usr/bin") or sys.executable}:
        if subprocess.run([python, "-c", needs], capture_output=True).returncode != 0:
            print(f"skipped: {python} has not all of numpy, h5py, matplotlib and PIL")
            return SKIPPED
    tutorials = sorted((PAGES / "tutorials").glob("*.md")) + [PAGES / "gallery.md"]
    names = arguments.pages or [page.stem for page in tutorials]
    failures = 0
    for name in names:
        try:
            page = next((page for page in tutorials if page.stem == name), None)
            if page is None:
                raise Wrong("there is no such tutorial")
            run_page(page, arguments.program.resolve(), arguments.pictures)
            print(f"{name}: as it says")
        except (Wrong, OSError, subprocess.TimeoutExpired) as problem:
            print(f"FAILED: {name}: {problem}")
            failures += 1
    return 1 if failures or not names else 0


if __name__ == "__main__":
    sys.exit(main())
