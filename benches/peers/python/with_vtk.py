"""VTK: edge connectivity, feature edges, and vtkOrientPolyData with consistency and outward normals."""

import vtk
from phases import Phases, load
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

phases = Phases()
v, g = load()
cells = vtk.vtkCellArray()
ids = numpy_to_vtkIdTypeArray(v.astype("i8").ravel(), deep=0)
cells.SetData(3, ids)
points = vtk.vtkPoints()
points.SetData(numpy_to_vtk(g, deep=0))
mesh = vtk.vtkPolyData()
mesh.SetPoints(points)
mesh.SetPolys(cells)
phases.done("load")


def edges(border, nonmanifold):
    """How many edges vtkFeatureEdges finds of a sort."""
    feature = vtk.vtkFeatureEdges()
    feature.SetInputData(mesh)
    feature.SetBoundaryEdges(border)
    feature.SetNonManifoldEdges(nonmanifold)
    feature.FeatureEdgesOff()
    feature.ManifoldEdgesOff()
    feature.ColoringOff()
    feature.Update()
    return feature.GetOutput().GetNumberOfLines()


border, nonmanifold = edges(True, False), edges(False, True)
phases.done("border")
phases.answer("border_edges", border)
phases.answer("nonmanifold_edges", nonmanifold)
parts = vtk.vtkPolyDataEdgeConnectivityFilter()
parts.SetInputData(mesh)
parts.SetExtractionModeToAllRegions()
parts.Update()
number = parts.GetNumberOfExtractedRegions()
del parts
phases.done("components")
phases.answer("components_joined", number)
orient = vtk.vtkOrientPolyData()
orient.SetInputData(mesh)
orient.ConsistencyOn()
orient.AutoOrientNormalsOn()
orient.Update()
phases.done("orientation")
phases.end(vtk_to_numpy(orient.GetOutput().GetPolys().GetConnectivityArray()).reshape(-1, 3))
