"""One rank of a parallel program, and the most memory it had: python3 peak.py program [arguments] ends with the line
"peak: <KiB>".
"""
import os
import sys

process = os.posix_spawnp(sys.argv[1], sys.argv[1:], os.environ)
_, status, usage = os.wait4(process, 0)
sys.stdout.write("peak: %d\n" % (usage.ru_maxrss // (1024 if sys.platform == "darwin" else 1)))
sys.exit(os.waitstatus_to_exitcode(status) and 1)
