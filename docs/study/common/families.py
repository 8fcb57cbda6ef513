"""Families of systems (tests/bench/scenes.cpp) and the solvers that are compared on them."""

# name, title, options of tests/bench/scenes.cpp; {foreign}: written by foreign.py and solved by tests/bench/solve.cpp
ALONE = (
    ("cube", "cube, Q1", "-scene cube"),
    ("balls4", "stiff balls, 1e4", "-scene cube -inclusion balls -contrast 1e4"),
    ("balls6", "stiff balls, 1e6", "-scene cube -inclusion balls -contrast 1e6"),
    ("fibers", "fibers, 1e6", "-scene cube -inclusion fibers -count 5 -contrast 1e6"),
    ("random", "E random per cell, 1 to 1e6", "-scene cube -inclusion random -contrast 1e6"),
    ("binary", "E 1 or 1e4 at random", "-scene cube -inclusion binary -contrast 1e4"),
    ("p1", "cube, P1", "-scene cube -element p1"),
    ("p2", "cube, P2", "-scene cube -element p2"),
    ("plate", "plate 1:50, Q1", "-scene plate"),
    ("plate_p1", "plate 1:50, P1", "-scene plate -element p1"),
    ("plate_p2", "plate 1:50, P2", "-scene plate -element p2 -nz 1"),
    ("shell", "shell 1:200, one layer", "-scene shell"),
    ("beam", "beam 50:1", "-scene beam"),
    ("stretched10", "flat elements 10:10:1", "-scene stretched -aspect 10"),
    ("stretched100", "flat elements 100:100:1", "-scene stretched -aspect 100"),
    ("nu49", "Poisson's ratio .49", "-scene cube -nu 0.49"),
    ("nu499", "Poisson's ratio .499", "-scene cube -nu 0.499"),
    ("nu4999", "Poisson's ratio .4999", "-scene cube -nu 0.4999"),
    ("square", "2-D square", "-scene square"),
    ("square_balls", "2-D, stiff discs 1e6", "-scene square -inclusion balls -contrast 1e6"),
    ("beam2d", "2-D beam 100:1", "-scene beam2d"),
    ("heat", "heat", "-scene heat"),
    ("heat_random", "heat, random 1 to 1e6", "-scene heat -inclusion random -contrast 1e6"),
    ("frame", "frame, 6 unknowns a node", "-scene frame"),
    ("foreign", "ball with holes, tetrahedra of GetFEM", "foreign"),
)
TIED = (
    ("balls_tied", "tied cubes with stiff balls, 1e4", "-scene balls_tied -contrast 1e4"),
    ("balls_tied6", "tied cubes with stiff balls, 1e6", "-scene balls_tied -contrast 1e6"),
    ("balls_slip", "slipping cubes with stiff balls, 1e4", "-scene balls_tied -contrast 1e4 -stick 0"),
    ("fibers_tied", "tied cubes with fibers, 1e6", "-scene fibers_tied -contrast 1e6"),
    ("fibers_slip", "half slipping cubes with fibers, 1e4", "-scene fibers_tied -contrast 1e4 -stick 0.5"),
    ("periodic", "periodic cell", "-scene periodic -inclusion none"),
    ("periodic_balls", "periodic cell with balls, 1e3", "-scene periodic -inclusion balls -contrast 1e3"),
    ("periodic_fibers", "periodic cell with fibers, 1e6", "-scene periodic -inclusion fibers -contrast 1e6"),
    ("three_blocks", "cube slipping in three blocks", "-scene three_blocks"),
    ("three_blocks_balls", "the same with balls, 1e4", "-scene three_blocks -inclusion balls -contrast 1e4"),
    ("cyclic", "cyclic sector, rotated tie", "-scene cyclic"),
    ("cyclic_balls", "the same with balls, 1e4", "-scene cyclic -inclusion balls -contrast 1e4"),
    ("plate_block", "plate 1:50 on a block", "-scene plate_block"),
    ("beam_tied", "floating beam tied at its end", "-scene beam_tied"),
    ("tets", "tied cubes, P1", "-scene tets"),
    ("tets_p2", "tied cubes, P2", "-scene tets -element p2"),
    ("slabs", "six slabs, tie and slip in turn", "-scene slabs"),
)

# BoomerAMG as it is quickest: it takes 3.3 times as long (median) as it is set by default, 1.4 times without an
# aggressive level, 8.3 times with nodal coarsening, and HMG takes 4.5 times
TUNED = " -pc_hypre_boomeramg_".join(("-pc_type hypre", "coarsen_type PMIS", "interp_type ext+i",
    "relax_type_all Chebyshev", "P_max 4", "strong_threshold 0.5", "agg_nl 1"))
# name, title, options of the PC, title in a table
SOLVERS = (
    ("blocksa", "this multigrid", "-pc_type blocksa", "blocksa"),
    ("agg1", "BoomerAMG PMIS, agg_nl 1", TUNED, "agg_nl 1"),
    ("gamg", "GAMG", "-pc_type gamg -mat_no_inode", "GAMG"),
    ("ml", "ML", "-pc_type ml -mat_no_inode", "ML"),
)
OURS = "blocksa"


def choose(names, entries, groups=None):
    """The entries of these names, in the order of the list; a group's name stands for all of it."""
    wanted = set()
    for name in names:
        found = (groups or {}).get(name, [entry for entry in entries if entry[0] == name])
        if not found:
            raise ValueError("%s is none of %s" % (name,
                                                   ", ".join(list(groups or {}) + [entry[0] for entry in entries])))
        wanted.update(entry[0] for entry in found)
    return [entry for entry in entries if entry[0] in wanted]


def families(names):
    return choose(names, ALONE + TIED, {"alone": ALONE, "tied": TIED, "all": ALONE + TIED})


def solvers(names):
    return choose(names, SOLVERS, {"all": SOLVERS})


def constrained(family):
    return family in [entry[0] for entry in TIED]


def options(solver, tied):
    """With constraints the same PC is the inner one of PCAINSWORTH."""
    if not tied:
        return solver
    words = ["-ainsworth_" + word[1:] if word.startswith("-pc_") else word for word in solver.split()]
    return " ".join(["-ksp_type preonly -pc_type ainsworth -ainsworth_ksp_converged_reason"] + words)
