"""Writes a page of docs/: prose is broken at 120 columns; tables, pictures and commands are not."""
import re
import textwrap

WIDTH = 120
MARK = re.compile(r" (?=(?:[-+*=|#]+|\d+[.)]|>\S*)(?: |$))")  # what comes after would be a list, a table or a heading at the start of a line


def broken(line):
    if len(line) <= WIDTH or line.startswith(("|", "!", "#", "<", "    ")):
        return line
    bullet = re.match(r"(?:- )?", line).group(0)
    lines = textwrap.wrap(bullet + MARK.sub("\0", line[len(bullet):]), WIDTH, subsequent_indent=" " * len(bullet), break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines).replace("\0", " ")


def write(path, lines):
    with open(path, "w") as file:
        file.write("\n".join(map(broken, "\n".join(lines).split("\n"))).rstrip() + "\n")
