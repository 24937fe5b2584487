"""Whether an answer is right: counts against what is known, an orientation against the mesh itself.

Three words: right, wrong, and "not offered" where a tool gives no such answer. A tool may count
components across regular edges or across all edges: it is held to the count of the one that it
documents. So with borders: edges with one triangle, or corners without an opposite, where those on
non-manifold edges belong too.
"""

import json
import subprocess
from pathlib import Path

ANSWERS = ("opposites", "components", "border", "non-manifold", "orientation", "outward")
# What may be said for each, and which known count it is held to.
SAID = {
    "opposites": {"opposites": "corners_with_opposite"},
    "components": {"components": "components", "components_joined": "components_joined"},
    "border": {"border_edges": "border_edges", "corners_without_opposite": "corners_without_opposite"},
    "non-manifold": {"nonmanifold_edges": "nonmanifold_edges"},
}


def expected(truth):
    """The known counts, with those that follow from them."""
    regular = truth["distinct_edges"] - truth["border_edges"] - truth["nonmanifold_edges"]
    real = truth["triangles"] - truth["degenerate"]
    return {
        **truth,
        "corners_with_opposite": 2 * regular,
        "corners_without_opposite": 3 * real - 2 * regular,
    }


def counts(said, truth):
    """For each sort of count: the verdict, what was found and what was expected."""
    known, verdicts = expected(truth), {}
    for answer, names in SAID.items():
        held = [(name, said[name], known[key]) for name, key in names.items() if name in said and known[key] is not None]
        if not held:
            verdicts[answer] = {"verdict": "not offered"}
            continue
        wrong = [h for h in held if h[1] != h[2]]
        name, found, wanted = (wrong or held)[0]
        verdicts[answer] = {"verdict": "wrong" if wrong else "right", "of": name, "found": found, "expected": wanted}
    return verdicts


def orientation(case, oriented, python):
    """The verdicts on triangles that were oriented; by a process of the environment that has NumPy."""
    nothing = {"orientation": {"verdict": "not offered"}, "outward": {"verdict": "not offered"}}
    if oriented is None or not Path(oriented).exists():
        return nothing
    command = [python, Path(__file__).resolve().parent / "orientation.py", case.v, case.g, oriented]
    command += [case.reference] if case.reference else []
    ran = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if ran.returncode != 0:
        why = (ran.stderr.strip().splitlines() or ["no word"])[-1]
        return {"orientation": {"verdict": "not judged", "found": why}, "outward": {"verdict": "not judged"}}
    return json.loads(ran.stdout)


def all_of(case, run, oriented, python):
    """Every verdict on a run. One that did not end well has answers as far as it came; what it did not
    come to is "not reached", whether it would have been offered or not."""
    said = {line["answer"]: line["value"] for line in run["lines"] if "answer" in line}
    verdicts = {**counts(said, case.truth), **orientation(case, oriented, python)}
    if run["outcome"] != "ok":
        for verdict in verdicts.values():
            if verdict["verdict"] == "not offered":
                verdict["verdict"] = "not reached"
    return verdicts
