"""docs/troubleshooting.md: each message of an error, and each cause of a failure, that src/ has stands there, and none
that it has not.

python3 messages.py <folder of the project>
"""
import os
import re
import sys

ROOT = sys.argv[1]
CALL = re.compile(r"\b(PetscCheck|SETERRQ|PetscSNPrintf)\(")
# where texts are made that no PetscCheck() has
FAILURES = ("diagnose/explain.cpp", "inner/setup.cpp", "pc/pcjudge.cpp", "pc/pcapply.cpp", "pc/pcsetup.cpp")
TEXT = re.compile(r'"((?:[^"\\]|\\.)*)"')
ELLIPSIS = re.compile(r"\.\.\.|-?ainsworth_|-ksp_rtol|projectedcg")
VALUE = re.compile(r"%[-+.\d]*[a-z]|%(?=\x00)|\x00")


def files():
    for here, _, names in os.walk(os.path.join(ROOT, "src")):
        for name in names:
            if name.endswith((".cpp", ".h")):
                path = os.path.join(here, name)
                yield os.path.relpath(path, os.path.join(ROOT, "src")), path


def calls(text):
    """The arguments of each call."""
    for match in CALL.finditer(text):
        depth, place, quoted = 0, match.end() - 1, False
        while True:
            if text[place] == '"' and text[place - 1] != "\\":
                quoted = not quoted
            if not quoted:
                depth += {"(": 1, ")": -1}.get(text[place], 0)
                if depth == 0:
                    break
            place += 1
        yield match.group(1), text[match.end():place]


def message(arguments):
    """The format, from its first literal to the next comma, with values as NUL."""
    arguments = re.sub(r"PetscInt(?:64)?_FMT", '"\x00"', arguments)
    first = re.search(r'"(?:[^"\\]|\\.)*"(?:\s*"(?:[^"\\]|\\.)*")*', arguments)
    return "".join(TEXT.findall(first.group(0))).replace('\\"', '"') if first else ""


def words(text, value):
    """What stands first between values, as a reader would look for it: some words, or the most there are."""
    parts = [part.strip(" ,;:()") for part in value.split(text)]
    return next((part for part in parts if len(part) > 10), max(parts, key=len))[:45].rstrip()


with open(os.path.join(ROOT, "docs", "troubleshooting.md"), encoding="utf-8") as file:
    page = file.read()
wrong, count, known = [], 0, ""
for name, path in files():
    with open(path, encoding="utf-8") as file:
        source = file.read()
    known += re.sub(r'"\s*(?:PetscInt(?:64)?_FMT\s*)?"', "", source)
    for kind, arguments in calls(source):
        first = words(message(arguments), VALUE)
        if kind == "PetscSNPrintf" and name not in FAILURES:
            continue
        if not first or (kind == "PetscSNPrintf" and len(first) < 11):  # a part of a message
            continue
        count += 1
        if first not in page:
            wrong.append("%s: not on the page: %s" % (name, first))
for quoted in re.findall(r"^- `([^`]*)`", page, re.MULTILINE):
    if words(quoted, ELLIPSIS) not in known:
        wrong.append("troubleshooting.md: not in src: %s" % quoted)
print("\n".join(wrong))
print("messages: %d of src, %s" % (count, "all on the page" if not wrong else "%d wrong" % len(wrong)))
sys.exit(bool(wrong))
