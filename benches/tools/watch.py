"""Runs a command and writes its seconds, peak memory and exit code to a file: `watch.py FILE COMMAND...`.

A small process of its own, since what the kernel counts as a child's peak begins with the memory of
the process that started it: a driver that holds NumPy arrays would lend them to every child.
"""

import json
import os
import sys
import time

start = time.monotonic()
child = os.posix_spawnp(sys.argv[2], sys.argv[2:], os.environ)
_, status, usage = os.wait4(child, 0)
with open(sys.argv[1], "w") as file:
    ended = {"seconds": time.monotonic() - start, "peak": usage.ru_maxrss * 1024}
    json.dump({**ended, "code": os.waitstatus_to_exitcode(status)}, file)
