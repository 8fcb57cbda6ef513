"""The transcript of README.md, or of another page: the command runs, prints these lines up to the digits of norms and
times, and takes these iterations.

python3 readme.py <page> <build> <launcher, one word each separated by a bar>
"""
import re
import subprocess
import sys

PAGE, BUILD, LAUNCHER = sys.argv[1:4]
with open(PAGE, encoding="utf-8") as file:
    block = re.search(r"^```\n\$ (.*?)\n```$", file.read(), re.DOTALL | re.MULTILINE).group(1).replace("\\\n", " ")
command, *printed = block.split("\n")
command = command.replace("$PWD/build/",
                          "build/").replace("build/", BUILD + "/").replace("mpiexec", LAUNCHER.replace("|", " "))
said = subprocess.run(command, shell=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
print("$ %s\n%s" % (command, said.stdout))


def pattern(line):
    """Integers, iterations among them, have to agree, other numbers not."""
    return re.sub(r"\d+\.\d+(e[-+]\d+)?", "#", " ".join(line.split()))


seen = [pattern(line) for line in said.stdout.splitlines()]
wrong = [line for line in printed if line.strip() != "..." and pattern(line) not in seen]
if said.returncode:
    wrong.append("exit code %d" % said.returncode)
print("\n".join("not printed: " + line
                for line in wrong) if wrong else "readme: %d lines as printed" % (len(printed) - 1))
sys.exit(bool(wrong))
