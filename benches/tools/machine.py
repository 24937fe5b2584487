"""The machine's name and the commit, in the words that `benches/build/machine.rs` uses."""

import os
import platform
import re
import subprocess

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def cpu():
    """The processor's model as the kernel has it, or else its architecture."""
    with open("/proc/cpuinfo") as info:
        for line in info:
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.machine()


def cores():
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0))


def slug():
    """The machine as part of a file name: `amd-epyc-2-cores`."""
    words = re.split("[^a-z0-9]+", f"{cpu()} {cores()} cores".lower())
    return "-".join(word for word in words if word)


def date():
    """The day as `date +%F` has it."""
    return subprocess.check_output(["date", "+%F"], text=True).strip()


def commit():
    """The commit that is checked out, with `-dirty` when files differ from it."""
    git = ["git", "-C", ROOT, "describe", "--always", "--dirty", "--abbrev=10"]
    done = subprocess.run(git, capture_output=True, text=True)
    return done.stdout.strip() or "unknown"


def stamp():
    """What heads a file of results."""
    return {"date": date(), "commit": commit(), "cpu": cpu(), "cores": cores()}
