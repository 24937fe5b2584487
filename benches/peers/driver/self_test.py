"""The judging, seen to say no: tools that lie, crash, hang and hoard, and a mesh that is known by hand.

The mesh is a tetrahedron, twice: 8 triangles, 2 closed components. Needs NumPy and SciPy in the Python
that runs it, nothing else.
"""

import json
import sys
import tempfile
from pathlib import Path

import judge
import meshes
import process
import report

TRUTH = {
    "triangles": 8,
    "degenerate": 0,
    "distinct_edges": 12,
    "border_edges": 0,
    "nonmanifold_edges": 0,
    "components": 2,
    "components_joined": 2,
}
HONEST = {"opposites": 24, "components": 2, "border_edges": 0, "nonmanifold_edges": 0}
TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


class Failed(Exception):
    """What a check found, and what it wanted."""


def same(what, found, wanted):
    if found != wanted:
        raise Failed(f"{what}: {found!r}, not {wanted!r}")


def tool(answers, then=""):
    """A program that says these answers, and then does something."""
    lines = [{"phase": "load", "seconds": 9.0}, {"phase": "opposites", "seconds": 1.0}]
    lines += [{"answer": name, "value": value} for name, value in answers.items()]
    text = "\n".join(json.dumps(line) for line in lines)
    return [sys.executable, "-c", f"import sys, time\nprint('''{text}''', flush=True)\n{then}"]


def verdicts(answers):
    run = process.run(tool(answers), 60, 2**33)
    same("a tool that ends well", run["outcome"], "ok")
    said = judge.counts({line["answer"]: line["value"] for line in run["lines"] if "answer" in line}, TRUTH)
    return {answer: verdict["verdict"] for answer, verdict in said.items()}


def check_counts():
    right = dict.fromkeys(judge.SAID, "right")
    same("an honest tool", verdicts(HONEST), right)
    for answer, names in judge.SAID.items():
        for name in names:
            if name in HONEST:
                lie = {**HONEST, name: HONEST[name] + 1}
                same(f"a tool that lies about {name}", verdicts(lie), {**right, answer: "wrong"})
        silent = {name: value for name, value in HONEST.items() if name not in names}
        same(f"a tool without {answer}", verdicts(silent), {**right, answer: "not offered"})
    # Right across regular edges does not hide a wrong count across all.
    same("two counts, one wrong", verdicts({**HONEST, "components_joined": 1})["components"], "wrong")
    same("corners without opposite", judge.expected({**TRUTH, "border_edges": 2})["corners_without_opposite"], 4)


def check_outcomes():
    crash = process.run(tool(HONEST, "sys.exit('went astray')"), 60, 2**33)
    same("a crash", (crash["outcome"], crash["message"]), ("crash", "exit code 1: went astray"))
    same("what a crashed tool had done", report.phases(crash), {"load": 9.0, "opposites": 1.0})
    killed = process.run(tool(HONEST, "import os; os.abort()"), 60, 2**33)
    same("a signal", (killed["outcome"], killed["code"]), ("crash", -6))
    hang = process.run(tool(HONEST, "time.sleep(60)"), 5, 2**33)
    same("a tool that hangs", (hang["outcome"], len(hang["lines"])), ("timeout", 2 + len(HONEST)))
    case = meshes.Case("two tetrahedra", "by hand", truth=TRUTH)
    hang["lines"] = hang["lines"][:3]
    said = judge.all_of(case, hang, None, sys.executable)
    same("what it did not come to", [said[a]["verdict"] for a in ("opposites", "components", "orientation")], ["right"] + ["not reached"] * 2)
    hoard = process.run(tool(HONEST, "a = bytearray(10**9)\nfor i in range(0, 10**9, 4096): a[i] = 1\ntime.sleep(60)"), 60, 2**28)
    same("a tool that hoards", hoard["outcome"], "memory")
    fine = process.run(tool(HONEST, "a = bytearray(200 * 2**20)\nfor i in range(0, len(a), 4096): a[i] = 1"), 60, 2**33)
    if not 200 <= fine["peak_mib"] <= 300:
        raise Failed(f"a tool that holds 200 MiB: {fine['peak_mib']} MiB")
    same("loading is not counted", report.total(fine, False), 1.0)


def check_rows():
    run = process.run(tool({**HONEST, "components": 3}), 60, 2**33)
    run["verdicts"] = judge.counts({**HONEST, "components": 3}, TRUTH)
    row = report.row({"name": "m", "order": "o", "triangles": 8}, "liar", [run])
    same("the cell of a wrong answer", report.mark(row, "components"), "✗ 3 (is 2)")
    same("the cell of a right answer", report.mark(row, "border"), "✓")
    late = {**run, "outcome": "timeout", "message": "more than 1 s"}
    row = report.row({"name": "m", "order": "o", "triangles": 8}, "slow", [late])
    same("a row without a run that ended", (row["seconds"], row["outcome"]), (None, "timeout"))
    if "timed out" not in report.table([row], {}):
        raise Failed("the table does not say that a tool timed out")


def check_orientation():
    import numpy as np

    v = np.array(TETRAHEDRON + [[a + 4 for a in t] for t in TETRAHEDRON], dtype="<u4")
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype="<f4")
    mixed, inward, half, other = v.copy(), v[:, [0, 2, 1]], v.copy(), v.copy()
    mixed[[1, 6]] = mixed[[1, 6]][:, [0, 2, 1]]
    half[4:] = half[4:][:, [0, 2, 1]]
    other[0, 0] = 3
    case = meshes.Case("two tetrahedra", "by hand")
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        case.v, case.g, out = place / "v.npy", place / "g.npy", place / "out.npy"
        np.save(case.v, mixed)
        np.save(case.g, np.concatenate([corners, corners + 5]))
        np.save(place / "reference.npy", v)
        for case.reference in (None, place / "reference.npy"):
            for name, triangles, wanted in [
                ("right", np.roll(v, 1, 1), ("right", "right")),
                ("untouched", mixed, ("wrong", "wrong")),
                ("all inward", inward, ("right", "wrong")),
                ("one inward", half, ("right", "wrong")),
                ("another vertex", other, ("wrong", "wrong")),
                ("one triangle less", v[1:], ("wrong", "wrong")),
                ("another order", v[::-1], ("wrong", "wrong")),
            ]:
                np.save(out, np.ascontiguousarray(triangles))
                said = judge.orientation(case, out, sys.executable)
                same(f"orientation, {name}", (said["orientation"]["verdict"], said["outward"]["verdict"]), wanted)


def main():
    """The number of checks that failed, told as a line each."""
    failed = 0
    for check in (check_counts, check_outcomes, check_rows, check_orientation):
        try:
            check()
            print(f"{check.__name__}: ok")
        except Failed as found:
            failed += 1
            print(f"{check.__name__}: {found}")
    return failed
