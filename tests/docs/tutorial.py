"""The commands of docs/tutorial.md, run in an empty folder by a user whose home has the plugin installed; what they
print is compared, up to numbers.

python3 tutorial.py <page> <cmake> <build> <mpicc> <launcher, one word each separated by a bar>
    <python with petsc4py, or none>
"""
import os
import re
import shutil
import subprocess
import sys

from transcript import missing

PAGE, CMAKE, BUILD, MPICC, LAUNCHER, PYTHON = sys.argv[1:7]


def steps(page):
    """(command, lines that it prints)"""
    found = []
    with open(page, encoding="utf-8") as file:
        for line in file:
            if line.startswith("    $ "):
                found.append((line[6:].strip(), []))
            elif line.startswith("    ") and found and open_block:
                found[-1][1].append(line.strip())
            open_block = line.startswith("    $ ") or (line.startswith("    ") and bool(found) and open_block)
    return found


home = os.path.abspath("home")
shutil.rmtree(home, ignore_errors=True)
os.makedirs(os.path.join(home, "bin"))
os.makedirs(os.path.join(home, "work"))
subprocess.run([CMAKE, "--install", BUILD, "--prefix", os.path.join(home, "ainsworth")], check=True,
               stdout=subprocess.DEVNULL)
links = subprocess.run([sys.executable, os.path.join(os.path.dirname(os.path.abspath(__file__)), "paths.py"),
                        os.path.join(home, "ainsworth", "share", "doc", "ainsworth"), "links"], check=False)
tools = {"mpicc": [MPICC], "mpiexec": LAUNCHER.split("|")}
if PYTHON != "none":
    tools["python3"] = [PYTHON]
for name, command in tools.items():
    path = os.path.join(home, "bin", name)
    with open(path, "w", encoding="utf-8") as file:
        file.write('#!/bin/sh\nexec %s "$@"\n' % " ".join(command))
    os.chmod(path, 0o755)
environment = dict(os.environ, HOME=home, PATH=os.path.join(home, "bin") + ":" + os.environ["PATH"])
session, wanted = "set -e\n", []
for command, printed in steps(PAGE):
    if PYTHON != "none" or not command.startswith("python3"):
        session += "echo '<<%d>>'\n%s\n" % (len(wanted), command)
        wanted.append((command, printed))
done = subprocess.run(["bash", "-c", session], cwd=os.path.join(home, "work"), env=environment, stdout=subprocess.PIPE,
                      stderr=subprocess.STDOUT, text=True)
parts = re.split(r"^<<\d+>>\n", done.stdout, flags=re.MULTILINE)[1:]
wrong = []
for i, (command, printed) in enumerate(wanted):
    said = parts[i] if i < len(parts) else ""
    print("$ %s\n%s" % (command, said), end="")
    wrong += missing(command, printed, said)
    if "the ties carry 1.00000" not in said and any("the ties carry" in line for line in printed):
        wrong.append("wrong answer of %s" % command)
if links.returncode:
    wrong.append("dead links of the installed pages")
if done.returncode:
    wrong.append("exit code %d" % done.returncode)
print("\n".join(wrong) if wrong else "tutorial: %d commands passed" % len(wanted))
sys.exit(bool(wrong))
