#!/usr/bin/env python3
"""Set-up and solve of contact problems with the default multigrid, beside A alone with it and with BoomerAMG: docs/multigrid-cost.csv.

/usr/bin/python3 docs/study/multigridcost.py                         all systems, 1 and 2 ranks, some minutes
/usr/bin/python3 docs/study/multigridcost.py --systems base nu --ranks 1 --repeat 5
Runs are interleaved; the least of the repetitions counts. Needs a build (AINSWORTH_BUILD, default build/); seconds need an otherwise idle machine.
"""
import argparse
import csv
import os

from common import machine

SYSTEMS = {
    "base": "-n1 24 -n2 20 -E2 10",
    "soft": "-n1 24 -n2 20 -E2 1e-3 -curved 0.15 -stick 0",
    "turned": "-n1 24 -n2 20 -E2 10 -rotate 20,35,50 -stick 0",
    "floating": "-n1 24 -n2 20 -E2 10 -floating 1",
    "nu": "-n1 20 -n2 18 -E2 10 -nu1 0.49 -nu2 0.49",
    "181k": "-n1 32 -n2 28 -E2 10",
    "560k": "-n1 48 -n2 40 -E2 10",
}
BOOMER = " -ainsworth_pc_type hypre -ainsworth_pc_hypre_boomeramg_agg_nl 0"
MODES = " -near_nullspace 1"


def save(path, rows):
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def variants(options):
    alone = options.replace(" -floating 1", "") + " -contact 0"
    return {"boomeramg_alone": alone + BOOMER, "blocksa_alone": alone + MODES, "blocksa": options + MODES, "blocksa_jcb": options + MODES + " -pc_ainsworth_pmat jcb",
            "blocksa_without_modes": options}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--systems", nargs="+", default=list(SYSTEMS), choices=list(SYSTEMS))
    parser.add_argument("--ranks", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs", "multigrid-cost.csv"))
    arguments = parser.parse_args()
    rows = []
    for ranks in arguments.ranks:
        for name in arguments.systems:
            best = {}
            for _ in range(arguments.repeat):
                for key, options in variants(SYSTEMS[name]).items():
                    run = machine.run(options, ranks)
                    if not machine.converged(run):
                        raise SystemExit("%s, %s: %s" % (name, key, run["reason"]))
                    if key not in best or run["setup"] + run["solve"] < best[key]["setup"] + best[key]["solve"]:
                        best[key] = run
            row = {"system": name, "ranks": ranks, "options": SYSTEMS[name]}
            row.update({key: "%.3f+%.3f (%d)" % (run["setup"], run["solve"], run["iterations"]) for key, run in best.items()})
            rows.append(row)
            total = {key: run["setup"] + run["solve"] for key, run in best.items()}
            print("%-9s %d ranks  %s  / BoomerAMG alone %.2f, / alone %.2f, jcb / alone %.2f" % (
                name, ranks, row["blocksa"], total["blocksa"] / total["boomeramg_alone"], total["blocksa"] / total["blocksa_alone"], total["blocksa_jcb"] / total["blocksa_alone"]), flush=True)
    save(arguments.out, rows)


if __name__ == "__main__":
    main()
