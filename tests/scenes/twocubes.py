"""Two tied cubes without inclusions must be the system of tests/bench/twocubes.cpp: python3 twocubes.py scenes
twocubes. The two programs share no code that assembles.
"""
import subprocess
import sys

import numpy
from petsc4py import PETSc


def read(prefix, name):
    matrix = PETSc.Mat().load(PETSc.Viewer().createBinary("%s_%s.dat" % (prefix, name)))
    starts, columns, values = matrix.getValuesCSR()
    dense = numpy.zeros(matrix.getSize())
    dense[numpy.repeat(numpy.arange(len(starts) - 1), numpy.diff(starts)), columns] = values
    return dense


def write(prefix, command):
    subprocess.run(command + ["-write_system", prefix], check=True, stdout=subprocess.DEVNULL)


def main():
    scenes, twocubes = sys.argv[1:3]
    for n, n2, stick in ((4, 3, "1"), (3, 4, "0"), (4, 2, "0.5")):
        write("ours", [scenes, "-scene", "tets", "-element", "q1", "-n", str(n), "-n2", str(n2), "-stick", stick,
                       "-solve", "0"])
        write("theirs", [twocubes, "-n1", str(n), "-n2", str(n2), "-E1", "1", "-E2", "1", "-stick", stick, "-ksp_type",
                         "preonly", "-pc_type", "none"])
        for name in ("A", "C"):
            ours, theirs = read("ours", name), read("theirs", name)
            if ours.shape != theirs.shape:
                sys.exit("%s is %s here, %s there" % (name, ours.shape, theirs.shape))
            worst = abs(ours - theirs).max() / abs(theirs).max()
            print("n %d, %d, stick %s: %s of %s differs by %.1e" % (n, n2, stick, name, ours.shape, worst))
            if not worst < 1e-13:
                sys.exit("%s is another matrix" % name)
    print("twocubes: same matrices")


main()
