"""What `pip install .` calls (PEP 517): CMake builds the package, this packs it as a wheel.

The folder build/release is used where it is there: what examples/run has built is not built again.
"""
import base64
import hashlib
import os
import re
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def metadata():
    """Name and contents of the wheel's .dist-info folder, but for RECORD."""
    version = re.search(r"project\(lahar VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = re.sub(r"[-.]", "_", sysconfig.get_platform())
    tag = f"{python}-{python}-{platform}"
    texts = {
        "METADATA": "Metadata-Version: 2.1\nName: lahar\n"
                    f"Version: {version}\n"
                    "Summary: Material Point Method engine whose timestep is a task graph\n"
                    "License: MIT\nRequires-Python: >=3.9\nRequires-Dist: numpy\n"
                    "Provides-Extra: all\n"
                    'Requires-Dist: pandas; extra == "all"\nRequires-Dist: matplotlib; extra == "all"\n',
        "WHEEL": f"Wheel-Version: 1.0\nGenerator: lahar\nRoot-Is-Purelib: false\nTag: {tag}\n",
    }
    return f"lahar-{version}.dist-info", texts, f"lahar-{version}-{tag}.whl"


def is_ours(build):
    """Whether a build folder is of these sources, and builds the package."""
    cache, rules = build / "CMakeCache.txt", build / "build.ninja"
    return (rules.is_file() and f"CMAKE_HOME_DIRECTORY:INTERNAL={ROOT}\n" in cache.read_text()
            and "lahar_python_package" in rules.read_text())


def build_package():
    """Builds; returns the folder of the package."""
    module = "_engine" + sysconfig.get_config_var("EXT_SUFFIX")
    build = ROOT / "build" / "release"
    if is_ours(build):
        package = compile_package(build)
        if (package / module).is_file():
            return package
    build = ROOT / "build" / "wheel"
    subprocess.run(["cmake", "-S", ROOT, "-B", build, "-G", "Ninja", "-Wno-dev", "-DLAHAR_TESTS=OFF",
                    "-DLAHAR_PYTHON=ON", f"-DLAHAR_PYTHON_PROGRAM={sys.executable}"], check=True)
    return compile_package(build)


def compile_package(build):
    subprocess.run(["cmake", "--build", build, "--target", "lahar_python_package"], check=True)
    return build / "python" / "lahar"


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    package = build_package()
    folder, texts, name = metadata()
    files = {f"lahar/{path.name}": path.read_bytes() for path in sorted(package.iterdir()) if path.is_file()}
    files.update({f"{folder}/{file}": text.encode() for file, text in texts.items()})
    record = ""
    for file, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record += f"{file},sha256={digest},{len(data)}\n"
    files[f"{folder}/RECORD"] = (record + f"{folder}/RECORD,,\n").encode()
    with zipfile.ZipFile(os.path.join(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:
        for file, data in files.items():
            wheel.writestr(file, data)
    return name


def build_sdist(sdist_directory, config_settings=None):
    raise RuntimeError("Lahar is installed from its repository: pip install .")
