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
ITERATIONS = "The paper reports 30 to 33 iterations for 5.5 million unknowns on 32 to 512 tasks, 18 to 23 on finer and finer meshes, and 22 to 24 over shares of 188 000 constraints."
