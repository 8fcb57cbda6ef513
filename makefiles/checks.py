#!/usr/bin/env python3
"""Which PetscCheck() of src/ never failed in a test: checks.py coverage.json root, from gcovr's JSON report."""
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
    checks = missed = 0
    for entry in report["files"]:
        covered = {line["line_number"]: line for line in entry["lines"]}
        for first, last in statements(f"{root}/{entry['file']}"):
            branches = [b for n in range(first, last + 1) if n in covered for b in covered[n].get("branches", [])]
            checks += 1
            # the condition of the check and the error call behind it: both ways of the first pair of branches
            if not branches or any(b["count"] == 0 for b in branches[:2]):
                missed += 1
                print(f"never failed in a test: {entry['file']}:{first}")
    print(f"{checks} checks, {missed} never failed")
    return missed > 0


if __name__ == "__main__":
    sys.exit(main())
