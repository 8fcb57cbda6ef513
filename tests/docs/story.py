"""The commands of docs/story.md on a coarser mesh: they print what the page says, up to numbers.

python3 story.py <root> <build> <python with petsc4py and gmsh> <launcher, one word each separated by a bar>
"""
import os
import re
import subprocess
import sys
import tempfile

from transcript import missing

ROOT, BUILD, PYTHON, LAUNCHER = sys.argv[1:5]
with open(os.path.join(ROOT, "docs", "story.md"), encoding="utf-8") as file:
    blocks = re.findall(r"^```\n(\$ .*?)\n```$", file.read(), re.DOTALL | re.MULTILINE)
commands = []  # and the lines that they print
for line in "\n".join(blocks).split("\n"):
    if line.startswith("$ "):
        commands.append((line[2:], []))
    else:
        commands[-1][1].append(line)


with tempfile.TemporaryDirectory() as folder:
    for name, to in (("docs", os.path.join(ROOT, "docs")), ("tutorials", os.path.join(ROOT, "tutorials")),
                     ("build", BUILD)):
        os.symlink(to, os.path.join(folder, name))
    session = ""
    for command, _ in commands:
        session += "echo '<<>>'\n%s\n" % re.sub(r"--h [0-9.]+", "--h 7", command)
    session = re.sub(r"\bmpiexec\b", LAUNCHER.replace("|", " "), re.sub(r"\bpython3\b", PYTHON, session))
    said = subprocess.run(["bash", "-c", session], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, check=False).stdout
print(said)
wrong = []
for (command, printed), text in zip(commands, re.split(r"^<<>>\n", said, flags=re.MULTILINE)[1:]):
    wrong += missing(command, printed, text)
print("\n".join(wrong) or "story: %d commands passed" % len(commands))
sys.exit(bool(wrong))
