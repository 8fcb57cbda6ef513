# For a repository of Spack packages, as ainsworth/package.py
from spack.package import *


class Ainsworth(CMakePackage):
    """Ainsworth's projection for saddle-point systems, a PETSc plugin that programs load at run time"""

    license("BSD-2-Clause")

    # with its url and sha256 once there is a public archive; until then: spack dev-build ainsworth@0.2.0
    version("0.2.0")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.20:", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("mpi")
    depends_on("metis")
    depends_on("petsc@3.18:3.26+shared+mpi")

    def cmake_args(self):
        return [
            self.define("BUILD_TESTING", False),
            self.define("PETSC_DIR", self.spec["petsc"].prefix),
            self.define("METIS_DIR", self.spec["metis"].prefix),
        ]

    def setup_run_environment(self, env):
        env.append_flags("PETSC_OPTIONS", "-dll_append " + join_path(self.prefix.lib, "libainsworth.so"))
