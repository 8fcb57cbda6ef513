"""What the paper reports (V. Robert, P. Jolivet, O. Jamond, M. A. Badri, sections 5.2 to 5.4), to stand beside what is measured."""

# table 2, 5.5 million unknowns: ranks -> rows of A per rank, ranks with rows of CC', rows of CC' on each of them: mean, least, most
TABLE2 = {
    32: (170000, 8, 3340, 2452, 4153),
    64: (85000, 13, 2055, 862, 3747),
    128: (42500, 18, 1484, 64, 2466),
    256: (21250, 29, 921, 239, 1434),
    512: (10625, 46, 581, 176, 1198),
}
TABLE2_EDGE = 96  # elements per edge of each cube
STRONG = "The paper reports 30 to 33 iterations on 32 to 512 tasks; its C has 27 000 rows."
WEAK = "The paper uses 48^3, 96^3 and 192^3 elements per cube on 8, 64 and 512 processes, 83 000 unknowns on each. Iterations grow from 18 for the smallest to 23 for the largest problem. Solve times are as expected of AMG, set-up times scale badly."
COST = "The paper uses M_JCB on 256 x 256 x 32 elements per body, 13 million unknowns and up to 188 000 constraints. It reports 22 to 24 iterations over all shares. Set-up and solve take constant time over the first half of the shares, then more, mostly by the Cholesky factorization of CC'."
