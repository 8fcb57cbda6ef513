#!/usr/bin/env python3
"""Programs of DOLFINx and GetFEM that factor, by MUMPS, and with the plugin in place of that: docs/lu.csv and a part of
docs/layouts.md.

/usr/bin/python3 docs/study/lu.py [--repeat 2]
    on an otherwise idle machine; needs python3-dolfinx-real and python3-getfem++
/usr/bin/python3 docs/study/lu.py --report
    the text from the CSV
"""
import argparse
import ctypes
import json
import os
import subprocess
import sys
import time

from common import machine, measured, prose
from common.prose import head, line

sys.path.append(os.path.join(machine.ROOT, "tutorials", "foreign"))
PATH = os.path.join(machine.ROOT, "docs", "lu.csv")
COLUMNS = ["program", "cells", "unknowns", "multipliers", "method", "setup", "solve", "memory_MiB", "difference"]
SYSTEMS = {"DOLFINx, periodic block": ("dolfinx", (12, 24, 32)),
           "GetFEM, contact with an obstacle": ("getfem", (12, 20, 28))}
METHODS = {"MUMPS": "-ksp_type preonly -pc_type lu -pc_factor_mat_solver_type mumps",
           "plugin": "-ksp_type preonly -pc_type ainsworth -ksp_error_if_not_converged"}


def dolfinx(n, method):
    """Matrix, right-hand side, the near null space that the plugin gets, and how fields are named."""
    import periodic_dolfinx as program
    from petsc4py import PETSc

    A, f, V = program.elasticity(n)
    C, g = program.ties(A, V)
    K = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(C)], [C, None]])
    coordinates = A.createVecRight()
    coordinates.setBlockSize(3)
    coordinates.setArray(V.tabulate_dof_coordinates()[:V.dofmap.index_map.size_local].ravel())
    A.setNearNullSpace(PETSc.NullSpace().createRigidBody(coordinates))
    b = PETSc.Vec().createWithArray([*f.array_r, *g.array_r], comm=program.comm)
    return (K.convert("aij", PETSc.Mat()) if method == "MUMPS" else K), b, C.getSize()[0], lambda pc: None


def getfem(n, method):
    """The first step of Newton's method, with the contact of all nodes of the bottom."""
    import contact_getfem as program
    from petsc4py import PETSc

    program.gf.util_trace_level(0)
    md, kept = program.block(n, 3)
    md.assembly("build_all")
    K, b = program.tangent(md)
    start, size = map(int, md.interval_of_variable("u"))

    def name(pc):
        rows = PETSc.IS().createStride(size, start, 1)
        coordinates = PETSc.Vec().createWithArray(kept[1].basic_dof_nodes()[:, ::3].T.ravel().copy(), bsize=3)
        rows.compose("nearnullspace", PETSc.NullSpace().createRigidBody(coordinates))
        pc.setFieldSplitIS(("u", rows))
    return K, b, K.getSize()[0] - size, name if method == "plugin" else lambda pc: None


def peak():
    with open("/proc/self/status") as file:
        return next(int(text.split()[1]) / 1024 for text in file if text.startswith("VmHWM"))


def work(name, n, method, path):
    """One solve, its solution saved; the memory is that beyond the program's own."""
    import numpy
    from petsc4py import PETSc

    K, b, multipliers, name_fields = {"dolfinx": dolfinx, "getfem": getfem}[name](n, method)
    ctypes.CDLL(None).malloc_trim(0)
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")
    before, begin = peak(), time.perf_counter()
    ksp = PETSc.KSP().create()
    ksp.setOperators(K)
    ksp.setFromOptions()
    name_fields(ksp.getPC())
    ksp.setUp()
    middle, x = time.perf_counter(), b.duplicate()
    ksp.solve(b, x)
    end = time.perf_counter()
    numpy.save(path, x.array_r)
    print(json.dumps({"unknowns": K.getSize()[0] - multipliers, "multipliers": multipliers,
                      "setup": round(middle - begin, 3), "solve": round(end - middle, 3),
                      "memory_MiB": round(peak() - before)}))


def measure(repeat):
    import numpy
    rows = []
    with machine.workspace() as folder:
        for title, (name, sizes) in SYSTEMS.items():
            for n in sizes:
                found = {}
                for method in METHODS:
                    path = os.path.join(folder, method + ".npy")
                    for _ in range(repeat):
                        run = subprocess.run(
                            [sys.executable, __file__, "--worker", name, str(n), method, path],
                            stdout=subprocess.PIPE, text=True, check=True,
                            env=dict(machine.ENVIRONMENT,
                                     PETSC_OPTIONS="-dll_append %s %s" % (machine.PLUGIN, METHODS[method])))
                        row = json.loads(run.stdout.splitlines()[-1])
                        if method not in found or (row["setup"] + row["solve"]
                                                   < found[method]["setup"] + found[method]["solve"]):
                            found[method] = row
                x, y = (numpy.load(os.path.join(folder, method + ".npy")) for method in ("plugin", "MUMPS"))
                for method, row in found.items():
                    rows.append(dict(row, program=title, cells=n, method=method, difference="%.0e" % (
                        numpy.linalg.norm(x - y) / numpy.linalg.norm(y)) if method != "MUMPS" else ""))
                    print(rows[-1], flush=True)
    measured.save(PATH, measured.provenance(), COLUMNS, rows)


def write():
    about, rows = measured.read(PATH)
    text = head("program", "unknowns", "multipliers", "MUMPS [s]", "plugin [s]", "MUMPS [MiB]", "plugin [MiB]",
                "difference of x and l")
    largest = {lu["program"]: (lu, ours) for lu, ours in zip(rows[::2], rows[1::2])}
    for lu, ours in largest.values():
        text.append(line(lu["program"], lu["unknowns"], lu["multipliers"],
                         *("%.2f" % (float(row["setup"]) + float(row["solve"])) for row in (lu, ours)),
                         lu["memory_MiB"], ours["memory_MiB"], ours["difference"]))
    prose.part(os.path.join(machine.ROOT, "docs", "layouts.md"), "lu.py", text + [
        "", "Made by `%s` on %s, one rank; memory is that beyond the assembled system. [lu.csv](lu.csv) has smaller "
        "ones." % (about["command"], about["machine"])])


def main():
    if sys.argv[1:2] == ["--worker"]:
        work(sys.argv[2], int(sys.argv[3]), *sys.argv[4:])
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=2, help="runs, of which the quickest counts (default 2)")
    parser.add_argument("--report", action="store_true", help="no runs: the text from the CSV")
    arguments = parser.parse_args()
    if not arguments.report:
        machine.require("petsc4py", "numpy")
        measure(arguments.repeat)
    write()


if __name__ == "__main__":
    main()
