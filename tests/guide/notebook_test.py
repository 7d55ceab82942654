#!/usr/bin/env python3
"""Notebooks of the guide are stored without outputs, and their cells run from the first to the last.

    notebook_test.py PACKAGE_FOLDER NOTEBOOK

Cells run as Jupyter runs them: the value of the last expression of a cell is shown, unless a semicolon ends it.
"""
import ast
import json
import os
import sys
import tempfile
from pathlib import Path

SKIPPED = 77
LARGEST = 40_000  # bytes


def check_stored(file, notebook):
    problems = []
    if notebook["nbformat"] != 4:
        problems.append(f"nbformat is {notebook['nbformat']}, not 4")
    if file.stat().st_size > LARGEST:
        problems.append(f"{file.stat().st_size} bytes; {LARGEST} are allowed")
    for number, cell in enumerate(notebook["cells"]):
        if set(cell) - {"cell_type", "id", "metadata", "source", "execution_count", "outputs"}:
            problems.append(f"cell {number} has keys of no notebook")
        if cell.get("outputs") or cell.get("execution_count") is not None:
            problems.append(f"cell {number} has outputs: store the notebook without them")
    if notebook["cells"][0]["cell_type"] != "markdown" or not notebook["cells"][0]["source"][0].startswith("# "):
        problems.append("the first cell is not a title")
    try:
        import nbformat
        nbformat.validate(notebook)
    except ImportError:
        pass  # not installed
    return problems


def run_cell(source, names, label):
    """Run the statements, and show the last one if it is an expression."""
    tree = ast.parse(source, label)
    shown = None
    if tree.body and isinstance(tree.body[-1], ast.Expr):
        shown = ast.Expression(tree.body.pop().value)
    exec(compile(tree, label, "exec"), names)
    if shown is not None:
        value = eval(compile(shown, label, "eval"), names)
        if value is not None and not source.rstrip().endswith(";"):
            print(getattr(value, "_repr_html_", value.__repr__)())


def main():
    package, file = sys.argv[1], Path(sys.argv[2])
    sys.path.insert(0, package)
    os.environ["MPLBACKEND"] = "Agg"
    try:
        import lahar  # noqa: F401
        import matplotlib.pyplot as plt
        import pandas  # noqa: F401
    except ImportError as missing:
        print(f"skipped: {missing}")
        return SKIPPED
    notebook = json.loads(file.read_text(encoding="utf-8"))
    problems = check_stored(file, notebook)
    names = {"__name__": "__main__"}
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for number, cell in enumerate(notebook["cells"]):
            if cell["cell_type"] == "code":
                run_cell("".join(cell["source"]), names, f"{file.name}, cell {number}")
        if not plt.get_fignums():
            problems.append("no cell draws")
        for figure in plt.get_fignums():
            plt.figure(figure).savefig(f"{figure}.png")
        os.chdir("/")
    for problem in problems:
        print(f"FAILED: {file.name}: {problem}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
