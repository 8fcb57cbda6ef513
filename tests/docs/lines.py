#!/usr/bin/env python3
"""No line of a source, a script or a CMake file has more than 120 columns: lines.py <project>"""
import os
import sys

KINDS = (".c", ".cc", ".cpp", ".h", ".py", ".sh", ".cmake", "CMakeLists.txt", "Makefile", "/.ci/run")
files, long = 0, []
for folder, folders, names in os.walk(sys.argv[1]):
    # what is built has a cache of CMake, what is hidden is not ours
    folders[:] = [name for name in folders if (not name.startswith(".") or name == ".ci")
                  and not os.path.exists(os.path.join(folder, name, "CMakeCache.txt"))]
    for path in (os.path.join(folder, name) for name in names):
        if path.endswith(KINDS):
            files += 1
            with open(path, encoding="utf-8") as file:
                long += ["%s:%d" % (path, i) for i, line in enumerate(file, 1) if len(line.rstrip("\n")) > 120]
print("\n".join(long))
print("lines: %d files, %d lines too long" % (files, len(long)))
