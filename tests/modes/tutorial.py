"""Both tutorials of modes print the same frequencies.

tutorial.py <modes.py> <modes> <libainsworthslepc.so>
"""
import re
import subprocess
import sys

script, program, plugin = sys.argv[1:4]


def frequencies(*command):
    said = subprocess.run([*command, "-n", "20"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          check=False).stdout
    print("$ %s\n%s" % (" ".join(command), said))
    return [float(word) for word in re.findall(r"frequency +(\d\S*),", said)]


load = ["-dll_append", plugin, "-eps_type", "ainsworth"]
python = frequencies(sys.executable, script, *load)
c = frequencies(program, *load)
same = len(python) == 10 and python == c
print("tutorial: 10 frequencies agree" if same else "tutorial: not the same frequencies")
sys.exit(not same)
