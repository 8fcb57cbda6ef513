#!/usr/bin/env python3
"""The paper's experiments, at any size: docs/results/<experiment>.csv, a plot beside them, and a part of docs/cost.md.

/usr/bin/python3 docs/study/results.py strong
    5.2: 96^3 + 96^3 elements, with and without constraints, and the memory that takes
/usr/bin/python3 docs/study/results.py weak
    5.3: 24^3, 48^3, 96^3
/usr/bin/python3 docs/study/results.py cost
    5.4: set-up and solve against the number of constraints
/usr/bin/python3 docs/study/results.py flops
    operations of the events that assemble M_*
/usr/bin/python3 docs/study/results.py setup
    share of the set-up that is not BoomerAMG's
/usr/bin/python3 docs/study/results.py iterations
    on 1 to 16 ranks
/usr/bin/python3 docs/study/results.py messages
    messages and reductions of a projection
/usr/bin/python3 docs/study/results.py memory
    peak memory with and without constraints
/usr/bin/python3 docs/study/results.py --report
    text and plot from the CSV files; the others end with it, too

A size is N, N:M, NxZ or NxZ:M, with or without -contact after it: N elements per edge of the contact surface of the
upper body, M of the lower one (default seven eighths of N: the nodes do not meet), Z along the height (default N);
-contact: METIS knows which elements touch. A measurement that is made again takes the place of the old one; --missing
makes only those that are not there. Needs a build (AINSWORTH_BUILD, default build/) and Debian's python3-matplotlib;
seconds need an otherwise idle machine.
"""
import argparse
import os
import sys

from common import experiments, machine, measured

SIX = "jcb,id,bj_cc,bj_cg,cc,cg"
# sizes, ranks, pmats, variants, repetitions, seconds that a run may take
DEFAULTS = {
    "strong": ("96:96", "2", "auto", "weighted", 1, 3600),
    "weak": ("24-contact,48-contact,96-contact", "2", "auto", "weighted", 1, 3600),
    "cost": ("128x16-contact", "2", "auto," + SIX, "weighted,paper", 1, 600),
    "flops": ("64x8,64x16,64x32,16x16,32x16", "1", SIX, "weighted,paper", 1, 600),
    "setup": ("64x16,48", "1,2", "auto", "weighted", 3, 600),
    "iterations": ("24", "1,2,4,8,16", "auto", "weighted", 1, 600),
    "messages": ("24", "8,16", "auto", "weighted", 1, 600),
    "memory": ("64x16,48", "1,2", "auto", "weighted", 1, 600),
}


def words(text):
    return [word for word in text.split(",") if word]


def numbers(text):
    try:
        return [int(word) for word in words(text)]
    except ValueError:
        raise argparse.ArgumentTypeError("%s is no list of numbers" % text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    measured.experiment(parser, list(experiments.ALL))
    parser.add_argument("--sizes", type=words, help="sizes, with commas between them")
    parser.add_argument("--ranks", type=numbers, help="numbers of ranks")
    parser.add_argument("--pmats", type=words, help="preconditioning matrices, auto: the default")
    parser.add_argument("--variants", type=words, help="weighted, paper")
    parser.add_argument("--fractions", type=words, default=words("0,0.05,0.1,0.25,0.5,0.75,1"),
                        help="shares of the rows of C (cost; default 0,0.05,0.1,0.25,0.5,0.75,1)")
    parser.add_argument("--repeat", type=int, help="seconds are the least of this many runs")
    parser.add_argument("--limit", type=int, help="seconds that one run may take")
    parser.add_argument("--missing", action="store_true", help="make no measurement again that is there")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs", "results"), help="folder of the CSV files "
                        "and the plot (default docs/results); the text is in cost.md beside it")
    arguments = parser.parse_args()
    arguments.out = os.path.abspath(arguments.out)
    if not arguments.report:
        machine.require("matplotlib")
        sizes, ranks, pmats, variants, repeat, limit = DEFAULTS[arguments.experiment]
        for name, default in (("sizes", words(sizes)), ("ranks", numbers(ranks)), ("pmats", words(pmats)),
                              ("variants", words(variants)), ("repeat", repeat), ("limit", limit)):
            if getattr(arguments, name) is None:
                setattr(arguments, name, default)
        experiments.ALL[arguments.experiment](arguments)
    from common import page
    page.write(arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
