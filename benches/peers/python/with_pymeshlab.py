"""pymeshlab: get_topological_measures (components and counts at once), re-orientation."""

import pymeshlab
from phases import Phases, load

phases = Phases()
v, g = load()
meshes = pymeshlab.MeshSet()
meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=g.astype("f8"), face_matrix=v.astype("i4")))
del v, g
phases.done("load")
found = meshes.get_topological_measures()
phases.done("border")
phases.answer("components_joined", found["connected_components_number"])
phases.answer("border_edges", found["boundary_edges"])
phases.answer("nonmanifold_edges", found["non_two_manifold_edges"])
oriented = None
try:
    meshes.meshing_re_orient_faces_coherently()
    phases.done("orientation")
    oriented = True
except pymeshlab.PyMeshLabException as error:
    phases.refused("orientation", error)
phases.end(meshes.current_mesh().face_matrix() if oriented else None)
