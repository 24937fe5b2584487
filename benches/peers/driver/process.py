"""One run of a program: wall time, peak memory, what it printed, and how it ended.

The peak is ru_maxrss of that child alone, from wait4. Memory is held by watching the resident size
twenty times a second rather than by limiting addresses, since some libraries reserve far more addresses
than they use; and a child is what the kernel would choose first if the machine ran out.
"""

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

TICK = 0.05


def resident(pid):
    """Resident bytes of a process, 0 when it is gone."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError, ValueError):
        return 0


def _expendable():
    try:
        Path("/proc/self/oom_score_adj").write_text("800")
    except OSError:
        pass


def run(command, timeout, memory):
    """Runs it; the answer is a dictionary that can be kept as JSON.

    `outcome` is ok, crash, timeout or memory; `lines` is what it printed as JSON, line by line.
    """
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        start = time.perf_counter()
        child = subprocess.Popen(
            command, stdout=out, stderr=err, stdin=subprocess.DEVNULL, preexec_fn=_expendable
        )
        try:
            outcome, status, usage, seconds = watch(child, start, timeout, memory)
        except BaseException:
            child.kill()
            raise
        child.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0), err.seek(0)
        lines, noise = parse(out.read().decode(errors="replace"))
        noise += err.read().decode(errors="replace").splitlines()
    code = child.returncode
    if outcome is None:
        # SIGKILL that is not ours is the kernel's, for want of memory.
        outcome = "ok" if code == 0 else "memory" if code == -9 else "crash"
    return {
        "outcome": outcome,
        "code": code,
        "wall": seconds,
        "cpu_seconds": usage.ru_utime + usage.ru_stime,
        "peak_mib": usage.ru_maxrss / 1024,
        "lines": lines,
        "message": message(outcome, noise, timeout, memory, code),
    }


def watch(child, start, timeout, memory):
    """Waits for a child, and ends it when it takes more than it may: why (or None), status, usage, seconds."""
    outcome = None
    while True:
        pid, status, usage = os.wait4(child.pid, os.WNOHANG)
        seconds = time.perf_counter() - start
        if pid:
            return outcome, status, usage, seconds
        held = resident(child.pid)
        if outcome is None and (seconds > timeout or held > memory):
            outcome = "timeout" if seconds > timeout else "memory"
            child.kill()
        # Short at first, so that the wall time of a short run is not rounded up to the tick.
        time.sleep(min(TICK, 0.001 + seconds / 50))


def message(outcome, noise, timeout, memory, code):
    """Why a run ended as it did, in a line."""
    if outcome == "timeout":
        return f"more than {timeout:g} s"
    if outcome == "memory":
        return f"more memory than {memory / 2**30:.1f} GiB"
    said = [line.strip() for line in noise if line.strip()]
    if outcome == "crash":
        return f"exit code {code}: {said[-1][:200] if said else 'no word'}"
    return ""


def parse(text):
    """The lines that are JSON objects, and the others."""
    lines, noise = [], []
    for line in text.splitlines():
        try:
            value = json.loads(line)
            (lines if isinstance(value, dict) else noise).append(value if isinstance(value, dict) else line)
        except ValueError:
            noise.append(line)
    return lines, noise
