"""README and the pages of docs/: links lead somewhere, files that are named are there, each file of docs/ belongs to a
page.

python3 paths.py <folder of the project>          python3 paths.py <installed pages> links     the links alone
"""
import os
import re
import sys

ROOT, WHOLE = sys.argv[1], sys.argv[2:] != ["links"]
LINK = re.compile(r"\]\(([^)\s]+)\)")
NAMED = re.compile(r"(?<![\w./-])(?:\.ci|docs|include|makefiles|src|tests|tutorials)/[\w./-]*\w")
wrong = []


def files(folder):
    """All below a folder of the project, the programs of docs/study apart."""
    for here, folders, names in os.walk(os.path.join(ROOT, folder)):
        folders[:] = [name for name in folders if name != "study"]
        for name in names:
            yield os.path.relpath(os.path.join(here, name), ROOT)


def read(page):
    with open(os.path.join(ROOT, page), encoding="utf-8") as file:
        return file.read()


def anchors(page):
    """Those that GitHub makes of the headings."""
    for heading in re.findall(r"^#+ (.*)$", read(page), re.MULTILINE):
        yield re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


pages = ["README.md"] + sorted(name for name in files("docs") if name.endswith(".md"))
linked = set()
for page in pages:
    text = read(page)
    for link in LINK.findall(text):
        if "://" in link:
            continue
        path, _, anchor = link.partition("#")
        target = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
        linked.add(target)
        if not os.path.exists(os.path.join(ROOT, target)):
            wrong.append("%s: no %s" % (page, link))
        elif anchor and anchor not in anchors(target):
            wrong.append("%s: no heading %s" % (page, link))
    wrong += ["%s: no %s" % (page, path)
              for path in NAMED.findall(text) if WHOLE and not os.path.exists(os.path.join(ROOT, path))]
guide = LINK.findall(read("README.md"))
wrong += ["README.md has no link to %s" % page for page in pages if page.startswith("docs/") and page not in guide]
for name in files("docs"):
    if name not in linked and (name.endswith((".md", ".svg", ".png")) or os.path.dirname(name) not in linked):
        wrong.append("no page has a link to %s" % name)

print("\n".join(wrong) if wrong else "paths: %d pages passed" % len(pages))
sys.exit(bool(wrong))
