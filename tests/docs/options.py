"""Options of -help, of the manual pages and of docs/ are the same; the manual pages become HTML: options.py <manual.py>
<program> <plugin>
"""
import subprocess
import sys

manual, program, plugin = sys.argv[1:4]
with open("help", "w", encoding="utf-8") as file:
    for pc in ("ainsworth", "blocksa"):
        command = [program, "-dll_append", plugin, "-ksp_type", "cg", "-pc_type", pc, "-help"]
        # blocksa does not solve what the program has
        subprocess.run(command, stdout=file, stderr=subprocess.DEVNULL, check=False)
for arguments in (("--check", "help"), ("--html", "manual")):
    if subprocess.run([sys.executable, manual, *arguments], check=False).returncode:
        sys.exit(1)
