#!/usr/bin/env python3
"""Which PetscCheck() of src/ never failed in a test: checks.py coverage.json root, from gcovr's JSON report.

PetscCheck() ends with `return code ? code : PETSC_ERR_RETURN`, behind the call of PetscError(): the last two branches
of its lines are taken if and only if the check has failed. A check without branches is constant in this build, or is
not compiled into it.
"""
import json
import re
import sys


def statements(path):
    """Line numbers of the PetscCheck() calls of a file, with the line each ends at."""
    lines = open(path, encoding="utf-8").read().split("\n")
    for first, line in enumerate(lines, 1):
        if not re.search(r"\bPetscCheck\(", line):
            continue
        depth, last = 0, first
        for last in range(first, len(lines) + 1):
            text = re.sub(r'"(\\.|[^"\\])*"', "", lines[last - 1])
            depth += text.count("(") - text.count(")")
            if depth <= 0:
                break
        yield first, last


def main():
    report, root = json.load(open(sys.argv[1], encoding="utf-8")), sys.argv[2]
    checks = constant = missed = 0
    for entry in report["files"]:
        branches = {line["line_number"]: [b["count"] for b in line["branches"]] for line in entry["lines"]}
        for first, last in statements(f"{root}/{entry['file']}"):
            counts = [count for n in range(first, last + 1) for count in branches.get(n, [])]
            checks += 1
            if not counts:
                constant += 1
                print(f"cannot fail in this build: {entry['file']}:{first}")
            elif not any(counts[-2:]):
                missed += 1
                print(f"never failed in a test: {entry['file']}:{first}")
    print(f"{checks} checks, {constant} cannot fail in this build, {missed} never failed")
    return missed > 0


if __name__ == "__main__":
    sys.exit(main())
