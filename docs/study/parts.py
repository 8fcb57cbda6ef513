#!/usr/bin/env python3
"""Constrained, unstructured parts as a mesher makes them (docs/study/parts/), written to files or solved.

/usr/bin/python3 docs/study/parts.py list                             parts and sizes
/usr/bin/python3 docs/study/parts.py check --parts cell rebars        what has to hold for a part
/usr/bin/python3 docs/study/parts.py write --part rebars --h 30 --to DIR   files for tests/bench/solve
/usr/bin/python3 docs/study/parts.py run --parts flange rebars --size 20k --ranks 1 2
/usr/bin/python3 docs/study/parts.py run --parts cell --size 0.2 --ranks 3 --methods modes clamped
/usr/bin/python3 docs/study/parts.py run --methods modes --parts flange --springs -10 -4 0 2 --oblique 0.5
/usr/bin/python3 docs/study/parts.py run --methods modes --name v --options "-ainsworth_pc_mg_cycle_type v"
/usr/bin/python3 docs/study/parts.py run --methods modes eliminated mumps --no-reference --out here.csv

run writes docs/parts.csv, where a solve that is measured again takes the place of the old one. Needs Debian's
python3-gmsh, python3-scipy and python3-petsc4py, and a build (AINSWORTH_BUILD, default build/); seconds need an
otherwise idle machine. change: seconds of the set-up after a change of C. Iterations are those of all reduced solves,
and of the last one. Memory is the sum over the ranks of the most that each had [MiB], with that of Python, before the
change.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile
import time

import parts
from common import families, machine, store

WORKER = os.path.join(machine.ROOT, "docs", "study", "common", "partsolver.py")
KEY = ["part", "size", "method", "ranks", "name"]
GAMG = "-pc_type gamg -pc_gamg_threshold 0.01"
BOOMERAMG = next(options for name, _, options, _ in families.SOLVERS if name == "agg1")


def fieldsplit(name):
    """The options of a file of tests/bench/solvers, but for those of its program."""
    with open(os.path.join(machine.ROOT, "tests", "bench", "solvers", name + ".opts"), encoding="utf-8") as file:
        lines = [line.strip() for line in file if line.startswith(("-ksp", "-pc", "-fieldsplit"))]
    return " ".join(lines + ["-ksp_rtol 1e-8"])


# what it is, the worker's method, rigid-body modes, options
METHODS = {
    "modes": ("the plugin with rigid-body modes", "ainsworth", True, ""),
    "plain": ("the plugin without", "ainsworth", False, ""),
    "multigrid": ("as modes, and nothing is factored instead", "ainsworth", True, "-pc_ainsworth_ladder multigrid"),
    "clamped": ("no constraints: CG and PCBLOCKSA", "clamped", True, ""),
    "mumps": ("MUMPS on the whole matrix", "mumps", False, ""),
    "gamg": ("no constraints: CG and GAMG", "clamped", True, GAMG),
    "boomeramg": ("no constraints: CG and BoomerAMG, one aggressive level", "clamped", True, BOOMERAMG),
    "eliminated": ("constraints eliminated: CG and PCBLOCKSA", "eliminated", True, ""),
    "eliminatedgamg": ("the same and GAMG", "eliminated", True, GAMG),
    "eliminatedboomeramg": ("the same and BoomerAMG", "eliminated", True, BOOMERAMG),
    "augmented": ("A + C'GC, block triangular: GMRES and one cycle of PCBLOCKSA (Golub and Greif 2003)", "fieldsplit",
                  True, fieldsplit("golub_greif")),
    "amgcl": ("no constraints: CG and AMGCL, its quickest variant, by the program AINSWORTH_AMGCL "
              "(docs/study/peers/amgcl.cpp)", "amgcl", True, ""),
    "muelu": ("the same and MueLu, by the program AINSWORTH_MUELU (docs/study/peers/muelu.cpp)", "muelu", True, ""),
    "amgf": ("A + C'D^-1 C, with D > 0: CG and MFEM's AMG with filtering, its quickest variant, by the program "
             "AINSWORTH_AMGF (docs/study/peers/amgf.cpp)", "amgf", True, ""),
}
# What solves the part without constraints
ALONE = {"clamped", "amgcl", "muelu"}
# Programs of peers without PETSc, and what they read; those without constraints solve to an error in x
CLAMPED = ("clamped_A", "clamped_f", "clamped_modes", "clamped_x")
PROGRAMS = {"amgcl": ("AINSWORTH_AMGCL", CLAMPED), "muelu": ("AINSWORTH_MUELU", CLAMPED),
            "amgf": ("AINSWORTH_AMGF", ("A", "C", "D", "f", "g", "modes"))}
USUAL = ["modes", "plain", "multigrid", "clamped", "mumps"]
DIGITS = {"setup": "%.3f", "solve": "%.3f", "change": "%.3f", "memory": "%.0f", "error": "%.2e", "primal": "%.2e",
          "constraint": "%.2e"}


def one_size(text):
    """A name, or a number; ValueError if it is neither."""
    if text not in parts.SIZES:
        float(text)
    return text


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("list", help="parts and sizes")
    one = commands.add_parser("write", help="files of a part")
    one.add_argument("--part", required=True, choices=parts.PARTS, metavar="NAME")
    one.add_argument("--h", type=float, required=True, help="size of the elements [mm]")
    one.add_argument("--order", type=int, default=1, choices=(1, 2))
    one.add_argument("--to", required=True, metavar="DIR", help="folder")
    one.add_argument("--npz", action="store_true", help="one file of numpy's instead, DIR/NAME.npz")
    for name, size, what in (("check", "small", "what has to hold for a part"), ("run", "20k", "solves parts")):
        several = commands.add_parser(name, help=what)
        several.add_argument("--parts", nargs="+", default=list(parts.PARTS), choices=parts.PARTS, metavar="NAME",
                             help="default: all")
        several.add_argument("--size", nargs="+", default=[size], type=one_size, metavar="SIZE",
                             help="of: %s, or that of linear elements [mm] (default %s)"
                             % (" ".join(parts.SIZES), size))
    several.add_argument("--methods", nargs="+", default=USUAL, choices=METHODS, metavar="NAME",
                         help="default " + " ".join(USUAL) + ": "
                         + "; ".join("%s, %s" % (key, how[0]) for key, how in METHODS.items()))
    several.add_argument("--ranks", nargs="+", type=int, default=[1], help="numbers of ranks (default 1)")
    several.add_argument("--repeat", type=int, default=1, help="runs of each, the quickest counts (default 1)")
    several.add_argument("--again", type=int, default=0, help="in each run, so many new solvers after the first one, "
                         "with memory that was used before; the quickest counts (default 0)")
    several.add_argument("--options", default="", help="more options of PETSc, for all methods")
    several.add_argument("--name", default="", help="a name of these options, in the CSV")
    several.add_argument("--limit", type=int, default=600, help="seconds that one run may take (default 600)")
    several.add_argument("--systems", nargs="+", default=[], metavar="PREFIX",
                         help="in the place of parts: systems that a program of tests/bench wrote (-write_system "
                         "PREFIX), or a file of tutorials/contact/peers (-write FILE)")
    several.add_argument("--springs", nargs="+", type=float, default=[], metavar="DECADE",
                         help="with a D of 10^DECADE times the flexibility of A under each row")
    several.add_argument("--central", nargs="+", type=float, default=[], metavar="DECADE",
                         help="of contact: the system of an interior-point method where slack * force is 10^DECADE "
                         "times their largest values")
    several.add_argument("--oblique", nargs="+", type=float, default=[], metavar="SHARE",
                         help="with a B whose columns differ from those of C by at most this share")
    several.add_argument("--no-reference", action="store_true",
                         help="no exact x, and no error, but for programs that need it")
    several.add_argument("--out", default=os.path.join(machine.ROOT, "docs", "parts.csv"),
                         help="file (default docs/parts.csv)")
    return parser.parse_args()


def write(options):
    """Prints how the files are solved."""
    from parts import files
    part = parts.make(options.part, options.h, options.order)
    if options.npz:
        os.makedirs(options.to, exist_ok=True)
        files.numpy_file(part, os.path.join(options.to, options.part + ".npz"))
        return
    sizes = files.petsc_files(part, options.to)
    # solve makes the modes of X, which would be wrong for extra unknowns
    written = ["A", "C"] + ["D"] * (part.D is not None) + ["f", "g"] + ["X"] * (not part.extra)
    print("%d unknowns, %d of them extra; %d rows" % (sizes["unknowns"], part.extra, sizes["rows"]))
    print(" ".join(["solve"] + ["-%s %s" % (name, os.path.join(options.to, name + ".dat")) for name in written]
                   + ["-dll_append", "libainsworth.so", machine.DEFAULTS]))


def program(method, folder):
    """The command of a peer without PETSc."""
    name, read = PROGRAMS[method]
    if name not in os.environ:
        sys.exit("parts.py: %s names no program; docs/study/peers/%s.cpp says how it is compiled" % (name, method))
    return [os.environ[name]] + [os.path.join(folder, file + ".dat") for file in read]


def best_variant(variants):
    """The quickest; each is the quickest of three set-ups with memory that was used before."""
    solved = [variant for variant in variants if variant.get("error", variant["residual"]) < 2e-8]  # 1e-8 is asked for
    best = min(solved or variants, key=lambda variant: variant["setup"] + variant["solve"])
    return dict(best, solver=best["variant"], primal=best["residual"], state="converged" if solved else "not converged")


def solve(folder, sizes, method, modes, ranks, again, options, limit):
    """The answer of the worker or of a program, or why there is none."""
    job = {"plugin": machine.PLUGIN, "folder": folder, "sizes": sizes, "method": method, "modes": modes,
           "again": again, "options": options.split()}
    path = os.path.join(folder, "job.json")
    with open(path, "w") as file:
        json.dump(job, file)
    try:
        text = machine.output(program(method, folder) if method in PROGRAMS
                              else machine.launcher(ranks) + [sys.executable, WORKER, path], limit)
    except subprocess.TimeoutExpired:
        return {"state": "time limit of %d s" % limit}
    answers = [json.loads(line) for line in text.splitlines() if line.startswith("{")]
    if not answers:
        return {"state": "no answer: " + (text.strip().splitlines() or [""])[-1][:80]}
    return best_variant(answers) if method in PROGRAMS else answers[-1]


def quickest(repeat, *how):
    """Of several solves."""
    answers = [solve(*how) for _ in range(repeat)]
    return min(answers, key=lambda answer: answer.get("setup", float("inf")) + answer.get("solve", float("inf")))


def figures(answer):
    """As the CSV has them."""
    row = {name: answer.get(name) for name in ("iterations", "last", "solver")}
    for name, digits in DIGITS.items():
        row[name] = None if answer.get(name) is None else digits % answer[name]
    return dict(row, state=answer["state"])


def changes(options):
    """What is done with a part: a name in the CSV, a function."""
    for decade in options.springs:
        yield "springs 1e%g" % decade, lambda part, d=decade: part.joined(d, d)
    for decade in options.central:
        yield "central 1e%g" % decade, lambda part, d=decade: part.central(d)
    for share in options.oblique:
        yield "oblique %g" % share, lambda part, s=share: part.oblique(s)
    if not options.springs and not options.central and not options.oblique:
        yield options.name, lambda part: part


def made(name, size):
    """A part, and the size and order of its elements; name may be a written system."""
    from parts import files
    if name not in parts.PARTS:
        return files.read_contact(name) if os.path.isfile(name) else files.read(name), "", 1
    h, order = parts.sized(name, size)
    return parts.make(name, h, order), h, order


def measure(name, size, change, options, table):
    """All methods on one part; change: see changes()."""
    from parts import files
    start = time.perf_counter()
    title, changed = change
    part, h, order = made(name, size)
    part, name = changed(part), os.path.basename(name)
    with tempfile.TemporaryDirectory(prefix="ainsworth-parts-") as folder:
        sizes = files.petsc_files(part, folder, any(METHODS[key][1] == "eliminated" for key in options.methods))
        del part
        print("%s %s %s: %d unknowns, %d rows, made in %.1f s"
              % (name, size, title, sizes["unknowns"], sizes["rows"], time.perf_counter() - start), flush=True)
        kinds = {METHODS[key][1] for key in options.methods}
        references = ["reference"] if kinds - ALONE and not options.no_reference else []
        if kinds & ALONE & set(PROGRAMS) or (kinds & ALONE and not options.no_reference):
            references.append("clampedreference")
        for reference in references:
            answer = solve(folder, sizes, reference, False, 1, 0, "", options.limit)
            if answer["state"] != "exact":
                print("  %s: %s" % (reference, answer["state"]), flush=True)
        for ranks in options.ranks:
            for method in options.methods:
                _, kind, modes, more = METHODS[method]
                answer = figures(quickest(options.repeat, folder, sizes, kind, modes, ranks, options.again,
                                          more + " " + options.options, options.limit))
                alone = kind in ALONE
                table.put(dict({"part": name, "order": order, "size": size, "h": h,
                                "unknowns": sizes["clamped" if alone else "unknowns"],
                                "rows": 0 if alone else sizes["rows"], "method": method,
                                "modes": "yes" if modes else "no", "ranks": ranks, "name": title}, **answer))
                print("  %-9s %d ranks: %s" % (method, ranks, " ".join(
                    "%s=%s" % pair for pair in answer.items() if pair[1] is not None)), flush=True)


def run(options):
    machine.require("petsc4py", "numpy", "scipy", "gmsh")
    table = store.Store(os.path.abspath(options.out), KEY)
    for name in options.systems or options.parts:
        for size in [""] if options.systems else options.size:
            for change in changes(options):
                measure(name, size, change, options, table)


def check(options):
    from parts import check as checks
    for name in options.parts:
        for size in options.size:
            start = time.perf_counter()
            found = checks.check(parts.make(name, *parts.sized(name, size)))
            print("%s %s: %s, %.1f s" % (name, size, " ".join("%s=%s" % pair for pair in found.items()),
                                         time.perf_counter() - start), flush=True)


def list_parts(_):
    for name in parts.PARTS:
        sizes = ("%g (%s)" % (parts.SIZES[size][name], size) for size in parts.SIZES)
        print("%-12s h = %s" % (name, ", ".join(sizes)))


def main():
    options = arguments()
    {"list": list_parts, "check": check, "write": write, "run": run}[options.command](options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
