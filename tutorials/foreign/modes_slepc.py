"""
Frequencies of two membranes that are tied along a side where their grids do not match: [A C'; C 0][u; l] = mu [M 0; 0
0][u; l].

SLEPc's shift-and-invert solves with A - sigma M and the constraints: for sigma at most the smallest mu that is what
PCAINSWORTH is for. The program knows SLEPc only; PETSC_OPTIONS loads the plugin and chooses it. Each run is compared
with LAPACK's eigenvalues of A in Ker C.

  $ export PETSC_OPTIONS="-dll_append /path/of/libainsworth.so -st_ksp_type preonly -st_pc_type ainsworth"
  $ export PETSC_OPTIONS="$PETSC_OPTIONS -st_ainsworth_ksp_converged_reason"
  $ mpiexec -n 2 python3 modes_slepc.py
    Linear st_ainsworth_ solve converged due to CONVERGED_RTOL iterations 2
    ...
  nest, sigma 0: mu = 4.5842, 10.3732, 13.2926, 17.3799; difference from LAPACK below 1e-7: yes
  ...
"""
import sys
try:
    import numpy as np
    from petsc4py import PETSc
    from slepc4py import SLEPc
except ImportError as why:
    print('skipped:', why)
    sys.exit(77)

comm = PETSc.COMM_WORLD
wanted = 4


def membrane(n, mass):
    """n x n nodes, fixed but for the right side; stiffness and mass of each, and the numbers of the nodes on that side
    """
    line = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    across = line.copy()
    across[-1, -1] = 1.0
    weights = np.ones(n)
    weights[-1] = 0.5
    return (np.kron(line, np.diag(weights)) + np.kron(np.eye(n), across),
            np.kron(np.eye(n), np.diag(weights)) * mass, np.arange(n) * n + n - 1)


def matrix(dense):
    A = PETSc.Mat().createAIJ(dense.shape, comm=comm)
    A.setUp()
    A.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    for i in range(*A.getOwnershipRange()):
        columns = np.flatnonzero(dense[i])
        A.setValues([i], columns.astype(PETSc.IntType), dense[i, columns])
    A.assemble()
    return A


def frequencies(K, M, sigma):
    eps = SLEPc.EPS().create(comm)
    eps.setOperators(K, M)
    eps.setProblemType(SLEPc.EPS.ProblemType.GNHEP)
    eps.setTarget(sigma)
    eps.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    eps.setDimensions(wanted)
    eps.getST().setType(SLEPc.ST.Type.SINVERT)
    eps.setFromOptions()
    eps.solve()
    return np.sort([eps.getEigenvalue(i).real for i in range(min(wanted, eps.getConverged()))])


def main():
    coarse, fine = 12, 17
    (A1, M1, side1), (A2, M2, side2) = membrane(fine, 1.0 / fine**2), membrane(coarse, 3.0 / coarse**2)
    n1, n = len(A1), len(A1) + len(A2)
    A, M, C = np.zeros((n, n)), np.zeros((n, n)), np.zeros((fine, n))
    A[:n1, :n1], A[n1:, n1:], M[:n1, :n1], M[n1:, n1:] = A1, A2, M1, M2
    # a node of the fine side lies between two of the coarse one
    for i, place in enumerate(np.linspace(0, coarse - 1, fine)):
        k = min(int(place), coarse - 2)
        C[i, side1[i]] = 1.0
        C[i, n1 + side2[k:k + 2]] = -(k + 1 - place), -(place - k)
    none = np.zeros((fine, fine))

    kernel = np.linalg.svd(C)[2][np.linalg.matrix_rank(C):].T
    factor = np.linalg.inv(np.linalg.cholesky(kernel.T @ M @ kernel))
    exact = np.linalg.eigvalsh(factor @ kernel.T @ A @ kernel @ factor.T)[:wanted]

    nests = [PETSc.Mat().createNest([[matrix(X), matrix(Y.T)], [matrix(Y), None if Y is C else matrix(none)]],
                                    comm=comm) for X, Y in ((A, C), (M, 0 * C))]
    wholes = [matrix(np.block([[X, Y.T], [Y, none]])) for X, Y in ((A, C), (M, 0 * C))]
    good = True
    for name, (K, mass), sigma in (('nest', nests, 0.0), ('one matrix', wholes, 0.0),
                                   ('one matrix', wholes, 0.5 * exact[0]), ('one matrix', wholes, -exact[0])):
        found = frequencies(K, mass, sigma)
        same = len(found) == wanted and np.abs(found / exact - 1).max() < 1e-7
        good = good and same
        PETSc.Sys.Print(f'{name}, sigma {sigma:.4g}: mu = {", ".join(f"{mu:.4f}" for mu in found)}; '
                        f'difference from LAPACK below 1e-7: {"yes" if same else "no"}')
    return 0 if good else 1


sys.exit(main())
