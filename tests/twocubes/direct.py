"""direct.py twocubes plugin: the plugin against dense LU of the whole saddle-point matrix, and the contact patch test.
"""
import subprocess
import sys

import petsc4py
twocubes, plugin = sys.argv[1:3]
petsc4py.init([sys.argv[0], "-dll_append", plugin])
from petsc4py import PETSc  # noqa: E402
import numpy as np  # noqa: E402


def system(options):
    subprocess.run([twocubes, "-write_system", "system", "-ksp_type", "preonly", "-pc_type", "none"] + options.split(),
                   check=False, stdout=subprocess.DEVNULL)
    load = lambda kind, name: kind.load(PETSc.Viewer().createBinary("system_%s.dat" % name, "r"))
    A, C = load(PETSc.Mat().create(), "A"), load(PETSc.Mat().create(), "C")
    f, g = load(PETSc.Vec().create(), "f"), load(PETSc.Vec().create(), "g")
    return A, C, f, g


def dense(M):
    D = M.convert("dense", PETSc.Mat())  # has a name: the array is gone with it
    return D.getDenseArray().copy()


def ours(A, C, f, g, options):
    K = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(C)], [C, None]])
    ksp = PETSc.KSP().create()
    ksp.setOperators(K)
    ksp.setType("preonly")
    ksp.getPC().setType("ainsworth")
    for name, value in options.items():
        PETSc.Options().setValue(name, value)
    ksp.setFromOptions()
    b, x = K.createVecs()
    b.setArray(np.concatenate([f.getArray(), g.getArray()]))
    ksp.solve(b, x)
    for name in options:
        PETSc.Options().delValue(name)
    assert ksp.getConvergedReason() > 0, ksp.getConvergedReason()
    return np.split(x.getArray().copy(), [A.getSize()[0]])


def check(what, got, bound):
    print("%-60s %.1e (bound %.0e)" % (what, got, bound))
    if not got <= bound:
        sys.exit("direct: FAILED at " + what)


for options in ("", "-rotate 20,35,50 -stick 0", "-curved 0.15 -gap 0.02", "-floating -rotate 20,35,50", "-E2 1e-6",
                "-E2 1e6 -gap 0.004", "-rowscale 3", "-nu1 0.49 -nu2 0.49", "-fraction 0.4"):
    A, C, f, g = system("-n1 4 -n2 3 " + options)
    Ad, Cd, n, m = dense(A), dense(C), A.getSize()[0], C.getSize()[0]
    scale = 1 / np.linalg.norm(Cd, axis=1)  # rows of very different scales: equilibrate, for the dense LU only
    K = np.block([[Ad, (scale[:, None] * Cd).T], [scale[:, None] * Cd, np.zeros((m, m))]])
    rhs = np.concatenate([f.getArray(), scale * g.getArray()])
    exact = np.linalg.solve(K, rhs)
    exact += np.linalg.solve(K, rhs - K @ exact)
    x0, l0 = exact[:n], scale * exact[n:]
    energy = np.sqrt(x0 @ Ad @ x0)
    for variant in ("weighted", "paper"):
        if variant == "paper" and ("E2" in options or "rowscale" in options):
            continue  # the paper's form is not made for these
        x, l = ours(A, C, f, g,
                    {"ainsworth_ksp_rtol": "1e-11", "pc_ainsworth_variant": variant, "ainsworth_ksp_max_it": "2000"})
        check("%s %s: energy error of x" % (variant, options), np.sqrt(abs((x - x0) @ Ad @ (x - x0))) / energy, 1e-8)
        # the force on a soft body is a small difference
        check("%s %s: lambda" % (variant, options), np.linalg.norm((l - l0) / scale) / np.linalg.norm(l0 / scale),
              1e-4 if "1e-6" in options else 1e-6)

# Patch test: nu = 0, matching meshes, uniform compression. The stress is gamma / (H/E1 + H/E2), displacements are
# linear in z.
E1, E2, gamma, n = 2.0, 6.0, 0.01, 4
for stick in (0, 0.5, 1):
    A, C, f, g = system("-n1 %d -n2 %d -E1 %g -E2 %g -nu1 0 -nu2 0 -gamma %g -stick %g" % (n, n, E1, E2, gamma, stick))
    x, l = ours(A, C, f, g, {"ainsworth_ksp_rtol": "1e-12"})
    stress = gamma / (1 / E1 + 1 / E2)
    levels = np.arange(n + 1) / n
    uz = np.concatenate([-stress / E2 * levels, -stress / E2 - stress / E1 * levels])  # lower body, upper body
    check("patch, stick %g: horizontal displacements" % stick, max(abs(x[0::3]).max(), abs(x[1::3]).max()) / gamma,
          1e-9)
    check("patch, stick %g: vertical displacements" % stick,
          abs(np.sort(x[2::3]) - np.sort(np.repeat(uz, (n + 1) ** 2))).max() / gamma, 1e-9)
    check("patch, stick %g: contact force" % stick, abs(abs(l.sum()) - stress) / stress, 1e-8)
print("direct: passed")
