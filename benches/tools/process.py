"""Processes that are timed, and of which the kernel says the peak of resident memory."""

import json
import os
import statistics
import subprocess
import sys
import tempfile

WATCH = os.path.join(os.path.dirname(os.path.abspath(__file__)), "watch.py")


class Failed(Exception):
    """A process that was to succeed did not; says which, and its last words."""


class Ran:
    """Wall seconds, peak resident bytes and both outputs of a process that succeeded."""

    def __init__(self, seconds, peak, said):
        self.seconds, self.peak, self.said = seconds, peak, said


def run(command):
    """Runs to the end. Peak memory is `ru_maxrss` of that one child, which counts mapped files.

    About 9 MiB of the process that watches are its floor.
    """
    command = [str(word) for word in command]
    with tempfile.TemporaryFile() as said, tempfile.NamedTemporaryFile("r") as found:
        watch = [sys.executable, "-I", "-S", WATCH, found.name, *command]
        subprocess.run(watch, stdin=subprocess.DEVNULL, stdout=said, stderr=said)
        said.seek(0)
        text = said.read().decode(errors="replace")
        ended = json.loads(found.read() or '{"code": "never began"}')
    if ended["code"] != 0:
        raise Failed(f"{' '.join(command)}: exit code {ended['code']}: {text.strip()[-400:]}")
    return Ran(ended["seconds"], ended["peak"], text)


def spread(values):
    """Median, least and most."""
    return {"median": statistics.median(values), "min": min(values), "max": max(values), "runs": len(values)}
