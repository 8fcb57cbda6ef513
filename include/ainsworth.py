"""ainsworth from petsc4py, without a compiled part: the calls of petscainsworth.h that Python programs need, by ctypes.

    from petsc4py import PETSc      # or import dolfinx, or any module that has initialized PETSc
    import ainsworth
    ainsworth.load()
    pc.setType("ainsworth")

pc is the PETSc.PC of the program's KSP, after pc.setType() or ksp.setFromOptions().
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
    """Registers the types of the plugin with the PETSc of this process; again does no harm.

    Without a path the library is looked for in the folder above this file, where it is installed, and then wherever dlopen() looks:
    LD_LIBRARY_PATH and the system's folders."""
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
    """The solver of the reduced system, a PETSc.KSP."""
    ksp, python = ctypes.c_void_p(), ctypes.pythonapi
    _call("PCAinsworthGetKSP", ctypes.c_void_p(pc.handle), ctypes.byref(ksp))
    capsule = ctypes.py_object(PETSc.__pyx_capi__["PyPetscKSP_New"])
    python.PyCapsule_GetName.restype, python.PyCapsule_GetPointer.restype = ctypes.c_char_p, ctypes.c_void_p
    name = python.PyCapsule_GetName(capsule)
    address = python.PyCapsule_GetPointer(capsule, ctypes.c_char_p(name))
    return ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p)(address)(ksp)


def iterations(pc):
    """Of the last solve, in the reduced system."""
    return inner_ksp(pc).getIterationNumber()


def error_estimate(pc):
    """(iteration, lower, upper): bounds of the error of x in the energy norm, as PCAinsworthGetErrorEstimate() gives them."""
    iteration, lower, upper = _INT(), _REAL(), _REAL()
    _call("PCAinsworthGetErrorEstimate", ctypes.c_void_p(pc.handle), ctypes.byref(iteration), ctypes.byref(lower), ctypes.byref(upper))
    return iteration.value, lower.value, upper.value


def failure(pc):
    """Why the last set-up or solve failed, in words; empty where nothing did."""
    why = ctypes.c_char_p()
    _call("PCAinsworthGetFailure", ctypes.c_void_p(pc.handle), ctypes.byref(why))
    return why.value.decode()
