"""trimesh: cached properties of a mesh that is loaded as it is, then repair.fix_normals."""

import numpy as np
import trimesh
from phases import Phases, load

phases = Phases()
v, g = load()
mesh = trimesh.Trimesh(vertices=g, faces=v, process=False, validate=False)
phases.done("load")
pairs = mesh.face_adjacency
phases.done("opposites")
phases.answer("opposites", 2 * len(pairs))
labels = trimesh.graph.connected_component_labels(pairs, node_count=len(mesh.faces))
number = labels.max() + 1
phases.done("components")
phases.answer("components", number)
size = np.bincount(mesh.edges_unique_inverse)
border, nonmanifold = (size == 1).sum(), (size > 2).sum()
phases.done("border")
phases.answer("border_edges", border)
phases.answer("nonmanifold_edges", nonmanifold)
trimesh.repair.fix_normals(mesh, multibody=True)
phases.done("orientation")
phases.end(mesh.faces)
