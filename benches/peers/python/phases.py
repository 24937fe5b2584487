"""What the Python peers share: loading V and G, the clock, and the lines of JSON that the runner reads.

A line is printed as soon as a phase is over, so that a peer that is ended by a time-out has said what it
did. Usage of every peer: `PEER.py V.npy G.npy [OUT.npy]`; OUT gets the triangles as the peer oriented
them, for the judge, after all timing and after the peak of memory was taken.
"""

import json
import sys
import time

import numpy as np


class Phases:
    """Times phases and prints them."""

    def __init__(self):
        self.last = time.perf_counter()

    def _say(self, **line):
        print(json.dumps(line), flush=True)

    def done(self, name):
        now = time.perf_counter()
        self._say(phase=name, seconds=now - self.last)
        self.last = time.perf_counter()

    def answer(self, name, value):
        self._say(answer=name, value=int(value))
        self.last = time.perf_counter()

    def note(self, text):
        self._say(note=text)
        self.last = time.perf_counter()

    def refused(self, phase, error):
        """A phase that the library gave up, by its own word."""
        self._say(refused=phase, message=" ".join(str(error).split()))
        self.last = time.perf_counter()

    def end(self, oriented=None):
        """The peak of this process, and then, untimed, what the judge looks at."""
        with open("/proc/self/status") as status:
            for line in status:
                if line.startswith("VmHWM:"):
                    self._say(hwm_kib=int(line.split()[1]))
        self._say(finished=True)
        if oriented is not None and len(sys.argv) > 3:
            np.save(sys.argv[3], np.ascontiguousarray(oriented, dtype="<u4"))


def load():
    """V as u4 and G as f4, as they are in the files, less the triangles with a repeated vertex: no
    peer takes them well, and a careful user would leave them out."""
    v, g = np.load(sys.argv[1]), np.load(sys.argv[2])
    bad = v[:, 0] == v[:, 1]
    bad |= v[:, 1] == v[:, 2]
    bad |= v[:, 2] == v[:, 0]
    return (v[~bad] if bad.any() else v), g
