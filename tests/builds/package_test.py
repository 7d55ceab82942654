#!/usr/bin/env python3
"""Whether the package for Debian has what a user needs.

    package_test.py BUILD FOLDER

Makes the package of the build folder BUILD in FOLDER. Exit status 77: there is no dpkg-deb.
"""
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path


def said(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def main(build, folder):
    if not shutil.which("dpkg-deb") or not shutil.which("dpkg-shlibdeps"):
        print("there is no dpkg-deb, or no dpkg-shlibdeps")
        return 77
    shutil.rmtree(folder, ignore_errors=True)
    said("cpack", "--config", f"{build}/CPackConfig.cmake", "-B", folder)
    (package,) = Path(folder).glob("lahar_*.deb")
    files = re.findall(r"\./(\S+)$", said("dpkg-deb", "--contents", package), re.MULTILINE)
    examples = Path(__file__).parents[2] / "examples"
    for name in ["bin/lahar", "share/man/man1/lahar.1", "share/doc/lahar/LICENSE",
                 "share/bash-completion/completions/lahar", "share/zsh/vendor-completions/_lahar",
                 "share/fish/vendor_completions.d/lahar.fish",
                 *(f"share/doc/lahar/examples/{file.relative_to(examples)}"
                   for pattern in ("*.json", "landslide-terrain/*.*") for file in examples.glob(pattern))]:
        assert f"usr/{name}" in files, f"the package lacks /usr/{name}"
    depends = said("dpkg-deb", "--field", package, "Depends")
    for library in ("libtbb", "libhdf5", "libopenmpi"):
        assert library in depends, depends
    unpacked = Path(folder) / "unpacked"
    said("dpkg-deb", "--extract", package, unpacked)
    assert said(unpacked / "usr/bin/lahar", "--version").startswith("lahar ")
    modules = unpacked / "usr/lib/python3/dist-packages"
    if "usr/lib/python3/dist-packages/lahar/__init__.py" not in files:
        built = list(Path(build).glob("python/lahar/_engine*.so"))
        assert not built, "the package lacks the module for Python"
        return 0
    assert any(re.match(r"usr/lib/python3/dist-packages/lahar/_engine.*\.so$", file) for file in files)
    loaded = subprocess.run(["/usr/bin/python3", "-c", "import lahar; print(lahar.__file__)"], text=True,
                            capture_output=True, env=dict(os.environ, PYTHONPATH=str(modules)))
    assert loaded.stdout.startswith(str(modules)), loaded.stdout + loaded.stderr
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
