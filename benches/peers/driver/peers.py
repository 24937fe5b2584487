"""The peers: their names, what they are made of, and how they are called."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Peer:
    """One tool. A `module` makes it a Python peer, else it is a program peer-NAME."""

    name: str
    title: str
    packages: tuple
    module: str = ""
    orients: bool = False
    outward: bool = False

    def command(self, folder, here, mesh, out):
        """What to run on a mesh; `out` is for the oriented triangles, or None."""
        if self.module:
            start = [folder / "bin/python3", here / "python" / f"with_{self.name}.py"]
        else:
            start = [folder / "bin" / f"peer-{self.name}"]
        last = [out] if out and self.orients else []
        return [str(part) for part in [*start, mesh.v, mesh.g, *last]]


PEERS = (
    Peer("numpy", "NumPy + SciPy", ("numpy", "scipy"), "scipy.sparse.csgraph", True, True),
    Peer("trimesh", "trimesh", ("trimesh", "networkx"), "trimesh", True, True),
    Peer("libigl", "libigl", ("libigl",), "igl", True, True),
    Peer("vtk", "VTK", ("vtk",), "vtk", True, True),
    Peer("pymeshlab", "pymeshlab", ("pymeshlab",), "pymeshlab", True),
    Peer("open3d", "Open3D", ("open3d-cpu",), "open3d", True),
    Peer("meshlib", "MeshLib", ("meshlib",), "meshlib.mrmeshpy", True, True),
    Peer("cgal", "CGAL", ("libcgal-dev",), orients=True, outward=True),
    Peer("openmesh", "OpenMesh", ("libopenmesh-dev",)),
    Peer("draco", "Draco CornerTable", ("libdraco-dev",)),
    Peer("meshoptimizer", "meshoptimizer", ("libmeshoptimizer-dev",)),
)
