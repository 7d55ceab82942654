#!/usr/bin/env python3
"""Recipes for images and for Spack agree with the build: files, presets, options and versions that they name are there.

    recipes_test.py SOURCE
"""
import ast
import json
import re
import subprocess
import sys
from pathlib import Path

failures = []


def fail(text):
    failures.append(text)
    print(f"FAILED: {text}")


def instructions(file):
    """Instructions of a container file and their texts, with continued lines joined."""
    lines = [line for line in file.read_text().splitlines() if not line.lstrip().startswith("#")]
    for line in re.sub(r"\\\n\s*", "", "\n".join(lines)).splitlines():
        if line.strip():
            word, _, text = line.strip().partition(" ")
            yield word, text


def arrays_of(script):
    """Names of packages by the array of examples/setup.sh."""
    return {name: re.findall(r'"([^":]+):', body)
            for name, body in re.findall(r"^(\w+_packages)=\((.*?)\)$", script.read_text(), re.M | re.S)}


def check_container(source):
    file = source / "examples" / "packages" / "Containerfile"
    arrays = arrays_of(source / "examples" / "setup.sh")
    presets = {one["name"] for one in json.loads((source / "CMakePresets.json").read_text())["configurePresets"]}
    known = {"FROM", "WORKDIR", "COPY", "RUN", "ARG", "USER", "ENTRYPOINT", "CMD", "ENV"}
    stages, copied = [], set()
    for word, text in instructions(file):
        if word not in known:
            fail(f"{file.name} has the instruction {word}")
        elif word == "FROM":
            stages += re.findall(r" AS (\w+)$", text) or [""]
            if not text.startswith("debian:12"):
                fail(f"{file.name} begins with {text}, setup.sh with Debian 12")
        elif word == "COPY" and text.startswith("--from="):
            if text.split()[0].removeprefix("--from=") not in stages:
                fail(f"{file.name} copies from a stage that is not there: {text}")
        elif word == "COPY":
            *names, _ = text.split()
            copied.update(names)
            for name in names:
                if not (source / name).exists():
                    fail(f"{file.name} copies {name}, which is not there")
        elif word == "ARG" and text.startswith("PRESETS="):
            named = text.partition("=")[2].strip('"').split()
            if not set(named) <= presets or named[-1] != "package":
                fail(f"{file.name} has the presets {named}")
        elif word == "RUN":
            if subprocess.run(["sh", "-n", "-c", text], capture_output=True).returncode != 0:
                fail(f"{file.name} runs what is no command: {text}")
            for array in re.findall(r"\$\{(\w+_packages)\[@\]\}", text):
                if array not in arrays:
                    fail(f"{file.name} installs {array}, which setup.sh does not have")
            words = set(re.split(r"[\s\"]", text))
            repeated = [name for names in arrays.values() for name in names if name in words]
            if repeated:
                fail(f"{file.name} repeats packages of setup.sh: {repeated}")
        elif word in ("ENTRYPOINT", "CMD"):
            json.loads(text)
    # What the build reads of the top level, and what is installed from there.
    cmake = (source / "CMakeLists.txt").read_text()
    wanted = {"CMakeLists.txt", "CMakePresets.json", "runtime", "physics", "graph", "io", "examples"}
    wanted |= set(" ".join(re.findall(r"install\(FILES ([A-Z][^$]*?) DESTINATION", cmake)).split())
    for name in sorted(wanted - copied):
        fail(f"{file.name} does not copy {name}")


def text_of(node):
    """A string that is written in the recipe, with "" for what is put in."""
    return "".join(part.value if isinstance(part, ast.Constant) else "" for part in node.values) \
        if isinstance(node, ast.JoinedStr) else node.value


def calls(tree, name):
    """Arguments of the calls of a function or method."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and name == (
                node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", None)):
            yield node.args, {word.arg: word.value for word in node.keywords}


PACKAGES = {"Eigen3": "eigen", "TBB": "intel-oneapi-tbb", "fmt": "fmt", "HDF5": "hdf5",
            "nlohmann_json": "nlohmann-json", "CLI11": "cli11", "tsl-robin-map": "robin-map", "MPI": "mpi",
            "ZLIB": "zlib-api", "Python": "python", "pybind11": "py-pybind11"}
SYSTEM = {"Threads"}


def check_spack(source):
    cmake = (source / "CMakeLists.txt").read_text()
    folder = source / "examples" / "packages" / "spack"
    for file in folder.glob("packages/*/package.py"):
        tree = ast.parse(file.read_text(), str(file))
        name = "".join(word.capitalize() for word in file.parent.name.split("-"))
        if name not in [node.name for node in tree.body if isinstance(node, ast.ClassDef)]:
            fail(f"{file.relative_to(source)} has no class {name}")
    tree = ast.parse((folder / "packages" / "lahar" / "package.py").read_text())
    options = set(re.findall(r"^\s*(?:option|set)\((LAHAR_\w+)", cmake, re.M)) | set(
        re.findall(r"find_(?:program|path|library)\((\w+)", cmake))
    defined = [args[0].value for name in ("define", "define_from_variant") for args, _ in calls(tree, name)]
    for option in defined:
        if option not in options:
            fail(f"the recipe for Spack sets {option}, which CMakeLists.txt does not have")
    variants = {args[0].value for args, _ in calls(tree, "variant")}
    for args, _ in calls(tree, "define_from_variant"):
        if args[1].value not in variants:
            fail(f"the recipe for Spack has no variant {args[1].value}")
    needs = {}
    for args, _ in calls(tree, "depends_on"):
        spec = re.match(r"([\w-]+)(?:@([\d.]+):)?", text_of(args[0]))
        needs[spec.group(1)] = spec.group(2)
    for name, version in re.findall(r"^\s*find_package\(([\w-]+) ?([\d.]+)?", cmake, re.M):
        if name in SYSTEM:
            continue
        package = PACKAGES.get(name)
        if package not in needs:
            fail(f"the recipe for Spack does not have what CMakeLists.txt calls {name}")
        elif package != "mpi" and (needs[package] or "") != version:  # mpi: versions are those of implementations
            fail(f"the recipe for Spack has {package} {needs[package]}, CMakeLists.txt {name} {version}")
    minimum = re.search(r"cmake_minimum_required\(VERSION ([\d.]+)", cmake).group(1)
    if needs.get("cmake") != minimum:
        fail(f"the recipe for Spack has CMake {needs.get('cmake')}, CMakeLists.txt {minimum}")
    version = re.search(r"project\(lahar VERSION ([\d.]+)", cmake).group(1)
    if version not in [args[0].value for args, _ in calls(tree, "version")]:
        fail(f"the recipe for Spack does not have the version {version}")
    for module in ("scotch", "gdal", "otf2"):
        if module not in needs:
            fail(f"the recipe for Spack does not have {module}")


def main():
    source = Path(sys.argv[1])
    check_container(source)
    check_spack(source)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
