"""No circle of calls among the files of src/, and no folder that includes or calls a later one:
calls.py <nm> <folder of the project> <object files, with |>

The order of the folders is that of docs/architecture.md. Weak symbols are left out: templates and inline functions are
in every file that uses them.
"""
import os
import re
import subprocess
import sys

nm, root, objects = sys.argv[1:4]
with open(os.path.join(root, "docs/architecture.md"), encoding="utf-8") as file:
    order = re.findall(r"^- `(\w+)/`", file.read(), re.MULTILINE)


def folder(name):
    return name.split("/")[0] if "/" in name else None


def late(user, used):
    """Folders may use those before them, and the files beside them; plugin.cpp may use all."""
    return folder(user) and folder(used) and order.index(folder(used)) > order.index(folder(user))


def read_symbols():
    """The file that defines each function or variable, and those that each file uses."""
    defined, used = {}, {}
    for line in subprocess.run([nm, "-A", "-P", *(o for o in objects.split("|") if o.endswith(".o"))], check=True,
                               capture_output=True, text=True).stdout.splitlines():
        path, symbol, kind = re.match(r"(.*?):? (\S+) (\S)", line).groups()
        name = re.search(r"\.dir/(.*)\.cpp\.o", path).group(1)
        if kind in "TDBRC":
            defined[symbol] = name
        if kind == "U":
            used.setdefault(name, set()).add(symbol)
    return defined, used


def reach(calls, start):
    found, new = set(), [start]
    while new:
        for name in calls.get(new.pop(), {}):
            if name not in found:
                found.add(name)
                new.append(name)
    return found


defined, used = read_symbols()
calls = {}  # from file to file, with the symbols
for user, symbols in used.items():
    for symbol in symbols:
        if defined.get(symbol, user) != user:
            calls.setdefault(user, {}).setdefault(defined[symbol], []).append(symbol)

wrong = []
reached = {name: reach(calls, name) for name in calls}
circles = {frozenset(other for other in found if name in reached.get(other, ()))
           for name, found in reached.items() if name in found}
for circle in sorted(sorted(circle) for circle in circles):
    wrong.append("circle of calls: %s" % ", ".join(circle))
    wrong += ["  %s calls %s: %s" % (user, name, ", ".join(sorted(calls[user][name]))) for user in circle
              for name in circle if name in calls[user]]
wrong += ["%s calls %s: %s" % (user, name, ", ".join(sorted(calls[user][name]))) for user in sorted(calls)
          for name in sorted(calls[user]) if late(user, name)]

files = [os.path.relpath(os.path.join(path, name), os.path.join(root, "src"))
         for path, _, names in os.walk(os.path.join(root, "src")) for name in names]
for name in sorted(files):
    with open(os.path.join(root, "src", name), encoding="utf-8") as file:
        for included in re.findall(r'^#include "(.*)"', file.read(), re.MULTILINE):
            included = os.path.normpath(os.path.join(os.path.dirname(name), included))
            if late(name, included):
                wrong.append("%s includes %s" % (name, included))

print("\n".join(wrong) or "calls: %d files, no circle" % len(used))
sys.exit(bool(wrong))
