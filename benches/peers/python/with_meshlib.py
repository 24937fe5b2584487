"""MeshLib: a mesh from faces and vertices, components by edge, border edges; disoriented faces by rays.

Its topology cannot hold triangles that disagree: with its default it duplicates vertices there. What it
offers for orientation is findDisorientedFaces; those are turned and the mesh is made again, which is
kept unless it has more border than the first.
"""

import numpy as np
from meshlib import mrmeshnumpy, mrmeshpy
from phases import Phases, load

phases = Phases()
v, g = load()
v = v.astype("i4")
phases.done("load")
mesh = mrmeshnumpy.meshFromFacesVerts(v, g)
phases.done("opposites")
wrong = np.flatnonzero(mrmeshnumpy.getNumpyBitSet(mrmeshpy.findDisorientedFaces(mesh)))
if len(wrong):
    turned = v.copy()
    turned[wrong] = turned[wrong][:, [0, 2, 1]]
    again = mrmeshnumpy.meshFromFacesVerts(turned, g)
    if again.topology.findLeftBdEdges().count() <= mesh.topology.findLeftBdEdges().count():
        mesh, v = again, turned
phases.done("orientation")
number = mrmeshpy.MeshComponents.getAllComponentsMap(mrmeshpy.MeshPart(mesh))[1]
phases.done("components")
phases.answer("components", number)
border = mesh.topology.findLeftBdEdges().count()
phases.done("border")
phases.answer("corners_without_opposite", border)
phases.answer("opposites", 3 * mesh.topology.numValidFaces() - border)
dropped = len(v) - mesh.topology.numValidFaces()
if dropped:
    phases.answer("refused_triangles", dropped)
phases.end(v)
