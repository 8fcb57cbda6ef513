"""Lines of a page beside those that a command prints."""
import re


def pattern(line):
    """Numbers may differ in their last digits, and spaces; the words around MUMPS' error are those of a PETSc."""
    if "INFOG" in line:
        return re.search(r"INFOG\(1\)=-\d+", line).group(0)
    return re.sub(r"[-+]?\d+(\.\d+)?(e[-+]\d+)?", "#", " ".join(line.split()))


def missing(command, printed, said):
    """What a command should print and does not; said: its output."""
    seen = [pattern(line) for line in said.splitlines()]
    return ["not printed by %s: %s" % (command, line)
            for line in printed if line != "..." and pattern(line) not in seen]
