"""Use ainsworth from petsc4py: the functions of petscainsworth.h that Python programs need, called by ctypes.

    from petsc4py import PETSc      # or import dolfinx, or any module that has initialized PETSc
    import ainsworth
    ainsworth.load()
    pc.setType("ainsworth")

The argument pc of the functions below is the PETSc.PC of the program's KSP, of type "ainsworth". Set the type before by
pc.setType() or ksp.setFromOptions(). Functions that fail raise PETSc.Error.
"""
import ctypes
import os

from petsc4py import PETSc

_INT = ctypes.c_int64 if PETSc.IntType().itemsize == 8 else ctypes.c_int32
_REAL = ctypes.c_float if PETSc.RealType().itemsize == 4 else ctypes.c_double
_plugin = None


def _call(name, *arguments):
    code = getattr(load(), name)(*arguments)
    if code:
        raise PETSc.Error(code)


def load(path=None):
    """Load the plugin and register its types with the PETSc of this process. Repeated calls do no harm. Call it on all
    ranks.

    path: the file of the plugin. Without it, load() takes the library in the folder above this file, where it is
    installed, or else the one that dlopen() finds in LD_LIBRARY_PATH or in the folders of the system.

    Return the library, as a ctypes.CDLL. Raise OSError if there is no library, and PETSc.Error if it was compiled for
    another PETSc.
    """
    global _plugin
    if path or not _plugin:
        beside = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "libainsworth.so")
        plugin = ctypes.CDLL(path or (beside if os.path.exists(beside) else "libainsworth.so"), ctypes.RTLD_GLOBAL)
        code = plugin.AinsworthInitializePackage()
        if code:
            raise PETSc.Error(code)
        _plugin = plugin
    return _plugin


def inner_ksp(pc):
    """Return the solver of the reduced system, a PETSc.KSP (PCAinsworthGetKSP())."""
    ksp, python = ctypes.c_void_p(), ctypes.pythonapi
    _call("PCAinsworthGetKSP", ctypes.c_void_p(pc.handle), ctypes.byref(ksp))
    capsule = ctypes.py_object(PETSc.__pyx_capi__["PyPetscKSP_New"])
    python.PyCapsule_GetName.restype, python.PyCapsule_GetPointer.restype = ctypes.c_char_p, ctypes.c_void_p
    name = python.PyCapsule_GetName(capsule)
    address = python.PyCapsule_GetPointer(capsule, ctypes.c_char_p(name))
    return ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p)(address)(ksp)


def iterations(pc):
    """Return the iterations of the last solve of the reduced system."""
    return inner_ksp(pc).getIterationNumber()


def error_estimate(pc):
    """Return (iteration, lower, upper), bounds of the error of x in the energy norm (PCAinsworthGetErrorEstimate()).

    They need -pc_ainsworth_monitor_error or -pc_ainsworth_stop energy_error; without an estimate, raise PETSc.Error.
    upper is NaN if there is no upper bound.
    """
    iteration, lower, upper = _INT(), _REAL(), _REAL()
    _call("PCAinsworthGetErrorEstimate", ctypes.c_void_p(pc.handle), ctypes.byref(iteration), ctypes.byref(lower),
          ctypes.byref(upper))
    return iteration.value, lower.value, upper.value


def failure(pc):
    """Return the cause of the failure of the last set-up or solve, in words; empty if nothing failed
    (PCAinsworthGetFailure()).
    """
    why = ctypes.c_char_p()
    _call("PCAinsworthGetFailure", ctypes.c_void_p(pc.handle), ctypes.byref(why))
    return why.value.decode()


def from_mpc(mpc):
    """Return C, a PETSc.Mat with a row for each slave of a finalized dolfinx_mpc.MultiPointConstraint: C u = 0 where it
    holds.

    m x n: m slaves, each minus the combination of its masters, on the rank that owns it, and n unknowns laid out as in
    the matrix that dolfinx.fem.petsc.assemble_matrix() makes without the conditions. With this matrix as A, [A C'; C 0]
    is the system: a slave that a Dirichlet condition holds, too, may make its row zero or dependent on it, which
    PCAINSWORTH recognizes. Collective.
    """
    import numpy

    index, bs = mpc.function_space.dofmap.index_map, mpc.function_space.dofmap.index_map_bs
    coefficients, offsets = mpc.coefficients()
    slaves = mpc.slaves[: mpc.num_local_slaves]
    masters = [mpc.masters.links(slave) for slave in slaves]
    most = max(map(len, masters), default=0) + 1
    C = PETSc.Mat().createAIJ(((len(slaves), None), (bs * index.size_local, None)), nnz=(most, most),
                              comm=mpc.function_space.mesh.comm)
    for row, (slave, others) in enumerate(zip(slaves, masters), C.getOwnershipRange()[0]):
        local = numpy.append(slave, others)
        columns = bs * index.local_to_global(local // bs) + local % bs
        values = numpy.append(1.0, -coefficients[offsets[slave] : offsets[slave] + len(others)])
        C.setValues(row, columns.astype(PETSc.IntType), values, PETSc.InsertMode.ADD_VALUES)
    C.assemble()
    return C
