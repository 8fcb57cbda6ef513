#!/usr/bin/env python3
"""The manual pages, which are comments of the sources: docs/options.md is made of them, and HTML where it is asked for.

python3 docs/study/manual.py
    writes docs/options.md
python3 docs/study/manual.py --html <folder>
    writes a page for each function and type, with an index
python3 docs/study/manual.py --check <file>
    compares the options with the output of a program's -help, and docs/options.md with the pages
"""
import argparse
import glob
import html
import os
import re
import sys

from common import prose

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
OPTIONS = os.path.join(ROOT, "docs", "options.md")
PREFIXES = ("pc_ainsworth_", "pc_blocksa_")  # options of our own that a linear solve shows in its -help
HEAD = """# Options

Every option of the plugin. Of several values, the first is the default, unless the line says otherwise; a single \
number is the default.
[layouts.md](layouts.md) explains fields and block sizes, [multigrid.md](multigrid.md) the multigrid,
[method.md](method.md) the method.

The prefixes of inner solvers follow that of the program's solver:

| prefix | solver |
|---|---|
| `-ainsworth_ksp_`, `-ainsworth_pc_` | the reduced system: `-ainsworth_ksp_rtol 1e-10`, `-ainsworth_pc_type gamg` |
| `-ainsworth_mg_levels_`, `-ainsworth_mg_coarse_` | the levels of its multigrid, as for PETSc's `PCMG` |
| `-ainsworth_gram_ksp_`, `-ainsworth_gram_pc_` | the Gram matrix |
| `-ainsworth_whole_pc_` | the whole system, where it is factored: \
`-ainsworth_whole_pc_factor_mat_solver_type superlu_dist` |
"""
FOOT = """
## Error against run time

`-pc_ainsworth_monitor_error` bounds the error of x in the energy norm in every iteration. It takes `ascii` (a table on
the screen), `csv:errors.csv`, or `draw` (`draw:image:name` without X). A row appears some iterations late, when its
lower bound is accurate:

| column | |
|---|---|
| `solve`, `iteration`, `delay` | the row describes `iteration`; its lower bound uses `delay` further steps |
| `seconds` | for the set-up and for the solve so far, without the time of the monitor |
| `natural_norm` | sqrt(r' M^-1 r) of the reduced residual |
| `primal_residual`, `constraint_residual` | norms of f - A x - C' l and of g - C x, relative to f and g |
| `error_lower`, `error_upper`, `error_true` | bounds of the energy norm of the error; \
the error itself, with `-pc_ainsworth_reference` |
| `error_relative` | the upper bound over the energy norm of x |
| `multiplier_error` | the relative error of C' l, with `-pc_ainsworth_reference` |

`PCAinsworthGetErrorEstimate()` returns the bounds after the solve. `KSP`s on one communicator may share a CSV file;
`ascii:errors.csv:ascii_csv:append` appends to an old one.

    -pc_ainsworth_stop energy_error -pc_ainsworth_error_rtol 1e-6

stops the solve on these bounds, relative to x, and not on the relative tolerance of the inner `KSP`. Use both with
`-ksp_type preonly`, and with conjugate gradients in the natural norm, whose coefficients make the bounds: the square of
the lower one is a sum of alpha_j r_j' z_j (Hestenes and Stiefel 1952; Strakos and Tichy 2002), the upper one adds that
of Gauss-Radau quadrature (Meurant and Tichy 2013). Without `-pc_ainsworth_error_eigenvalue`, a lower bound of the
spectrum, it takes the smallest Ritz value and is an estimate, as far smaller eigenvalues may show late, with stiff
fibers for instance.
[cost.md](cost.md#the-error-estimate) says how sharp the bounds are.

**Tolerances.** `-ainsworth_ksp_rtol`, too, refers to the error of x in the energy norm. When PETSc's test is satisfied,
the plugin computes the norms of x and of its part in Ker C, z, and the smallest Ritz value theta, and iterates until r'
M^-1 r <= (2 rtol)^2 theta min(|x|, |z|)^2. A solve that rounding of x stops ends with `KSP_CONVERGED_ATOL`. A
convergence test of the program, and other norms, are left alone.
"""


class Page:
    def __init__(self, kind, text):
        self.kind = kind
        lines = [line[3:] if line.startswith("   ") else line for line in text.strip("\n").split("\n")]
        self.name, _, self.what = lines[0].strip().partition(" - ")
        while len(lines) > 1 and lines[1].strip():  # the first sentence may be long
            self.what += " " + lines.pop(1).strip()
        self.lines = lines[1:]

    def options(self):
        """(option, values, meaning) of "Options Database Keys"."""
        found, inside = [], False
        for line in self.lines:
            if line.startswith("Options Database"):
                inside = True
            elif inside and not line.strip():
                break
            elif inside:
                option = re.match(r"[+.-]  ?(-\S+) ?([<\[].*?[>\]])? *- (.*)$", line)
                if option:
                    found.append(option.groups(""))
                else:
                    found[-1] = found[-1][:2] + (found[-1][2] + " " + line.strip(),)
        return found


def pages():
    """By name."""
    found = {}
    for path in sorted(glob.glob(os.path.join(ROOT, "src", "**", "*.cpp"),
                                 recursive=True)) + [os.path.join(ROOT, "include", "petscainsworth.h")]:
        with open(path, encoding="utf-8") as file:
            for kind, text in re.findall(r"/\*(MC|@C?|E)\n(.*?)\n *(?:M|@|E)\*/", file.read(), re.DOTALL):
                page = Page(kind, text)
                found[page.name] = page
    return found


def types(found):
    """Pages of types, our preconditioner first."""
    return sorted((name for name in found if found[name].kind == "MC"),
                  key=lambda name: (name != "PCAINSWORTH", not name.startswith("PC"), name))


def options_page(found):
    text = HEAD
    for name in types(found):
        options = found[name].options()
        if options:
            text += "\n## %s\n\n%s.\n\n| option | values | |\n|---|---|---|\n" % (
                name, found[name].what[0].upper() + found[name].what[1:])
            text += "".join("| `%s` | %s | %s |\n" % (option, "`%s`" % values if values else "",
                                                      meaning.replace("|", "\\|"))
                            for option, values, meaning in options)
    text = "\n".join(prose.broken(line) for line in (text + FOOT).split("\n"))
    return (text + "\n`python3 docs/study/manual.py` makes this page from comments in `src/`. A test compares it with "
            "`-help`.\n")


def marked(text, found):
    """Of names in backticks, those of pages are links."""
    def link(name):
        page = name.group(1).split("(")[0]
        code = "<code>%s</code>" % name.group(1)
        return '<a href="%s.html">%s</a>' % (page, code) if page in found else code
    return re.sub(r"`([^`]+)`", link, html.escape(text, quote=False))


def body(page, found):
    """Paragraphs, headings that end with a colon, and lists whose items begin with + . -"""
    out, block = [], []

    def flush():
        if block and re.match(r"[+.-] ", block[0]):
            items = []
            for line in block:
                if re.match(r"[+.-] ", line):
                    items.append(line[1:].strip())
                else:
                    items[-1] += " " + line.strip()
            out.append("<ul>%s</ul>" % "".join("<li>%s</li>" % marked(item, found) for item in items))
        elif block:
            out.append("<p>%s</p>" % marked(" ".join(block), found))
        block.clear()

    for line in page.lines + [""]:
        if re.match(r"[A-Z][\w ]*:$", line):
            flush()
            out.append("<h2>%s</h2>" % line[:-1])
        elif line.startswith(".seealso:"):
            flush()
            out.append("<h2>See also</h2><p>%s</p>" % marked(line[9:].strip(), found))
        elif line.strip():
            block.append(line.strip())
        else:
            flush()
    return "\n".join(out)


def write_html(folder, found):
    frame = ('<!DOCTYPE html>\n<html lang="en"><meta charset="utf-8"><title>%s</title>\n'
             '<style>body{max-width:50em;margin:2em auto;padding:0 1em;font-family:sans-serif;line-height:1.5}'
             '</style>\n%s\n</html>\n')
    os.makedirs(folder, exist_ok=True)
    for name, page in found.items():
        with open(os.path.join(folder, name + ".html"), "w", encoding="utf-8") as file:
            file.write(frame % (name, '<p><a href="index.html">all pages</a></p><h1>%s</h1><p>%s</p>\n%s' % (
                name, marked(page.what, found), body(page, found))))
    entries = "".join('<li><a href="%s.html"><code>%s</code></a>: %s</li>\n' % (
        name, name, marked(found[name].what, found))
                      for name in sorted(found, key=str.lower))
    with open(os.path.join(folder, "index.html"), "w", encoding="utf-8") as file:
        file.write(frame % ("ainsworth", "<h1>Manual pages of ainsworth</h1><ul>\n%s</ul>" % entries))
    print("%d pages and index.html in %s" % (len(found), folder))


def own(text):
    return set(re.findall(r"-((?:%s)\w+)" % "|".join(PREFIXES), text))


def check(path, found):
    """What is wrong, a line each."""
    with open(path, encoding="utf-8", errors="replace") as file:
        told = own("\n".join(re.findall(r"^ +-(?:\w+_)?((?:%s)\w+)" % "|".join(PREFIXES), file.read(),
                                        re.MULTILINE)).replace("pc_", "-pc_"))
    documented = own("\n".join(option for name in types(found) for option, _, _ in found[name].options()))
    wrong = ["-help has -%s, its manual page does not" % name for name in sorted(told - documented)]
    wrong += ["a manual page has -%s, -help does not" % name for name in sorted(documented - told)]
    for page in sorted(glob.glob(os.path.join(ROOT, "docs", "*.md"))) + [os.path.join(ROOT, "README.md")]:
        with open(page, encoding="utf-8") as file:
            named = own(file.read())
        wrong += ["%s names -%s, which is no option" % (os.path.relpath(page, ROOT), name)
                  for name in sorted(named - told) if not any(other.startswith(name) for other in told)]
    for name, page in found.items():
        wrong += ["the page of %s refers to %s, which has none" % (name, other)
                  for other in re.findall(r"`(\w*Ainsworth\w*|\w*AINSWORTH)\(?\)?`", "\n".join(page.lines))
                  if other not in found]
    with open(OPTIONS, encoding="utf-8") as file:
        if file.read() != options_page(found):
            wrong.append("docs/options.md is not what the manual pages say: python3 docs/study/manual.py")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--html", metavar="FOLDER")
    parser.add_argument("--check", metavar="FILE")
    arguments = parser.parse_args()
    found = pages()
    if arguments.html:
        write_html(arguments.html, found)
    elif arguments.check:
        wrong = check(arguments.check, found)
        print("\n".join(wrong) if wrong else "manual: %d pages passed" % len(found))
        return bool(wrong)
    else:
        with open(OPTIONS, "w", encoding="utf-8") as file:
            file.write(options_page(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
