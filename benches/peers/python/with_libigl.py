"""libigl: triangle_triangle_adjacency, facet_components, unique_edge_map, bfs_orient, orient_outward."""

import igl
import numpy as np
from phases import Phases, load

phases = Phases()
v, g = load()
f, p = v.astype("i8"), g.astype("f8")
del v, g
phases.done("load")
adjacent = igl.triangle_triangle_adjacency(f)
phases.done("opposites")
adjacent = adjacent[0] if isinstance(adjacent, tuple) else adjacent
phases.answer("opposites", (adjacent >= 0).sum())
del adjacent
number, _ = igl.facet_components(f)
phases.done("components")
phases.answer("components_joined", number)
where = igl.unique_edge_map(f)[2]
size = np.bincount(where)
border, nonmanifold = (size == 1).sum(), (size > 2).sum()
del where, size
phases.done("border")
phases.answer("border_edges", border)
phases.answer("nonmanifold_edges", nonmanifold)
oriented, patch = igl.bfs_orient(f)
phases.done("orientation")
phases.answer("components", patch.max() + 1)
oriented, _ = igl.orient_outward(p, oriented, patch.reshape(-1, 1))
phases.done("outward")
phases.end(oriented)
