"""Prints the PETSc library that petsc4py uses."""
import os
from petsc4py import PETSc  # noqa: F401
libraries = {line.split()[-1] for line in open("/proc/self/maps") if "/libpetsc" in line}
print("\n".join(sorted(os.path.realpath(library) for library in libraries)))
