"""Lahar for Spack. In a checkout of Lahar:

    spack repo add examples/packages/spack
    spack install lahar dev_path="$PWD"
"""
from spack.package import *


class Lahar(CMakePackage):
    """Material Point Method engine for landslides, soils, fluids and solids. A time step is a task graph; results
    have the same bits on any number of threads and MPI ranks."""

    license("MIT")
    version("main", branch="main")
    version("0.1.0")

    variant("python", default=True, description="Build the Python package")
    variant("gdal", default=False, description="Read rasters and polygons from maps")
    variant("otf2", default=False, description="Write traces as OTF2, too")

    generator("ninja")
    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("eigen@3.4:")
    depends_on("intel-oneapi-tbb@2021.8:")
    depends_on("fmt@9:")
    depends_on("hdf5@1.10: ~mpi")
    depends_on("nlohmann-json@3.11:")
    depends_on("cli11@2.1:")
    depends_on("robin-map")
    depends_on("mpi")
    depends_on("zlib-api")
    depends_on("scotch ~mpi")
    depends_on("gdal", when="+gdal")
    depends_on("otf2", when="+otf2")
    with when("+python"):
        extends("python")
        depends_on("python@3.9:", type=("build", "link", "run"))
        depends_on("py-pybind11@2.10:", type="build")
        depends_on("py-numpy", type=("build", "run"))
        depends_on("py-pandas", type="run")
        depends_on("py-matplotlib", type="run")

    conflicts("%gcc@:11", msg="Lahar needs C++20 as GCC 12 has it")

    def cmake_args(self):
        args = [
            # The compiler wrappers say for which processor.
            self.define("LAHAR_NATIVE", False),
            self.define("LAHAR_TESTS", False),
            self.define_from_variant("LAHAR_GDAL", "gdal"),
            self.define_from_variant("LAHAR_OTF2", "otf2"),
            self.define_from_variant("LAHAR_PYTHON", "python"),
            # Scotch's own library leaves errors to another one.
            self.define("SCOTCH_INCLUDE_DIR", self.spec["scotch"].prefix.include),
            self.define("SCOTCH_LIBRARY", list(self.spec["scotch"].libs)),
        ]
        if self.spec.satisfies("+python"):
            python = self.spec["python"]
            args += [
                self.define("LAHAR_PYTHON_PROGRAM", python.command.path),
                self.define("LAHAR_PYTHON_FOLDER", f"lib/python{python.version.up_to(2)}/site-packages"),
            ]
        return args

    @run_after("install")
    @on_package_attributes(run_tests=True)
    def check_installed(self):
        Executable(self.prefix.bin.lahar)("info")
