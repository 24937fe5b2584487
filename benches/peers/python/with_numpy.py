"""NumPy and SciPy: what a Python user would write, `in_memory.py` of the bench of builds."""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "build"))
import in_memory  # noqa: E402
from phases import Phases, load  # noqa: E402

phases = Phases()
v, g = load()
phases.done("load")
o, one, other, same_way, size = in_memory.opposites(v)
phases.done("opposites")
label, flip, _ = in_memory.orient(v, one, other, same_way)
phases.done("components")
number = int(label.max()) + 1
flip, _ = in_memory.outward(v, g, o, label, flip, number)
in_memory.apply(v, o, flip)
phases.done("orientation")
border, nonmanifold = (size == 1).sum(), (size > 2).sum()
phases.done("border")
phases.answer("opposites", 2 * (size == 2).sum())
phases.answer("components", number)
phases.answer("border_edges", border)
phases.answer("nonmanifold_edges", nonmanifold)
phases.end(v)
