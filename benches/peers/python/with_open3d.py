"""Open3D: cluster_connected_triangles, get_non_manifold_edges, orient_triangles."""

import numpy as np
import open3d
from phases import Phases, load

phases = Phases()
v, g = load()
mesh = open3d.geometry.TriangleMesh(
    open3d.utility.Vector3dVector(g.astype("f8")),
    open3d.utility.Vector3iVector(v.astype("i4")),
)
del v, g
phases.done("load")
labels, sizes, _ = mesh.cluster_connected_triangles()
number = len(sizes)
del labels, sizes
phases.done("components")
phases.answer("components_joined", number)
nonmanifold = len(mesh.get_non_manifold_edges(allow_boundary_edges=True))
border = len(mesh.get_non_manifold_edges(allow_boundary_edges=False)) - nonmanifold
phases.done("border")
phases.answer("border_edges", border)
phases.answer("nonmanifold_edges", nonmanifold)
oriented = mesh.orient_triangles()
phases.done("orientation")
if not oriented:
    phases.refused("orientation", "orient_triangles returned False")
phases.end(np.asarray(mesh.triangles) if oriented else None)
