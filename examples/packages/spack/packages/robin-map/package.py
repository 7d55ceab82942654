"""The hash map that Lahar uses: headers only."""
from spack.package import *


class RobinMap(CMakePackage):
    """Hash map and hash set with robin hood hashing."""

    homepage = "https://github.com/Tessil/robin-map"
    git = "https://github.com/Tessil/robin-map.git"
    license("MIT")

    version("1.0.1", tag="v1.0.1")

    depends_on("cxx", type="build")
    depends_on("cmake@3.3:", type="build")
