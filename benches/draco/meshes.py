"""The meshes of the size table: real ones kept here or among the tests' meshes, and made ones.

Each is a name, what it is, whether it is real, and how to write it to disk. Nothing is random
but by a seed, so every machine has the same meshes.
"""

import gzip
import os

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
KEPT = os.path.join(HERE, "meshes")
TESTS = os.path.join(HERE, "..", "..", "tests", "meshes")


class Mesh:
    """`make(data_gen, stem)` writes the mesh and returns what `cornermill build` is given."""

    def __init__(self, name, words, real, make, large=False):
        self.name, self.words, self.real, self.make, self.large = name, words, real, make, large


def arrays(stem, triangles, points):
    """Writes V and G, and returns the arguments of `build`."""
    np.save(stem + ".npy", triangles.astype(np.uint32))
    np.save(stem + ".G.npy", points.astype(np.float32))
    return [stem + ".npy", "--positions", stem + ".G.npy"]


def heights(z, known, dx, dy):
    """Triangles over a grid of heights, two to a quad of which all corners are known."""
    rows, columns = z.shape
    ids = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = ids[:-1, :-1], ids[:-1, 1:], ids[1:, 1:], ids[1:, :-1]
    whole = known[:-1, :-1] & known[:-1, 1:] & known[1:, 1:] & known[1:, :-1]
    two = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], 2)[whole].reshape(-1, 3)
    used, triangles = np.unique(two, return_inverse=True)
    y, x = np.divmod(used, columns)
    return triangles.reshape(-1, 3), np.stack([x * dx, y * dy, z.ravel()[used]], 1)


def helens(_, stem):
    """A USGS DEM: records of 1024 bytes, a profile each (B records: 4 of them to a profile here).

    A profile has its number of elevations at byte 12, its place in metres at 24 and 48, then
    elevations of 6 characters each: 146 in its first record, 170 in each further one.
    """
    text = gzip.open(os.path.join(KEPT, "SainteHelens.dem.gz"), "rt").read()
    records = [text[i : i + 1024] for i in range(0, len(text), 1024)]
    profiles, at = [], 1
    while at < len(records) and len(profiles) < int(records[0][858:864]):
        head = records[at]
        count = int(head[12:18])
        place = [float(head[k : k + 24].replace("D", "E")) for k in (24, 48)]
        values, fields = [], head[144:1020]
        while True:
            values += [int(fields[k : k + 6]) for k in range(0, len(fields), 6) if fields[k : k + 6].strip()]
            at += 1
            if len(values) >= count:
                break
            fields = records[at][:1020]
        profiles.append((*place, values[:count]))
    west, south = (min(p[k] for p in profiles) for k in (0, 1))
    rows = max(round((p[1] - south) / 30) + len(p[2]) for p in profiles)
    z = np.zeros((rows, len(profiles)))
    known = np.zeros(z.shape, bool)
    for x, y, values in profiles:
        column, row = round((x - west) / 30), round((y - south) / 30)
        z[row : row + len(values), column] = values
        known[row : row + len(values), column] = True
    return arrays(stem, *heights(z, known, 30, 30))


def etopo(_, stem):
    """NOAA's relief of the Earth: the file ends with 540 rows of 1081 big-endian floats, in metres.

    Laid flat, 37 km to a step at the equator, heights 50 times what they are, as relief maps have it.
    """
    data = gzip.open(os.path.join(KEPT, "etopo20.cdf.gz")).read()
    z = np.frombuffer(data[-540 * 1081 * 4 :], ">f4").reshape(540, 1081).astype(float)
    return arrays(stem, *heights(50 * z, np.isfinite(z) & (np.abs(z) < 2e4), 37065, 37065))


# The six tetrahedra around the diagonal of a cube whose corner k has coordinates of its bits.
TETRAHEDRA = [(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)]


def turned(tetrahedron, ring, ins, out):
    """Whether a ring of edges, seen from the outside of the surface, runs clockwise."""
    corner = np.array([[k & 1, k >> 1 & 1, k >> 2 & 1] for k in tetrahedron], float)
    middle = [(corner[a] + corner[b]) / 2 for a, b in ring]
    normal = np.cross(middle[1] - middle[0], middle[2] - middle[0])
    return normal @ (corner[out].mean(0) - corner[ins].mean(0)) < 0


def gyroid(_, stem, n=96, periods=3):
    """An isosurface: a noisy gyroid in a cube of n^3 cells, by marching tetrahedra, with borders."""
    t = np.linspace(0, 2 * np.pi * periods, n + 1)
    x, y, z = np.meshgrid(t, t, t, indexing="ij")
    f = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    f = (f + 0.02 * np.random.default_rng(7).standard_normal(f.shape)).ravel()
    side = n + 1
    cell = np.arange(n)
    base = ((cell[:, None, None] * side + cell[None, :, None]) * side + cell[None, None, :]).ravel()
    corner = np.array([(k & 1) * side * side + (k >> 1 & 1) * side + (k >> 2 & 1) for k in range(8)])
    faces = []
    for tetrahedron in TETRAHEDRA:
        ids = base[:, None] + corner[list(tetrahedron)]
        inside = f[ids] > 0
        for mask in range(1, 15):
            hit = ids[(inside @ (1 << np.arange(4))) == mask]
            ins = [k for k in range(4) if mask >> k & 1]
            out = [k for k in range(4) if not mask >> k & 1]
            # The edges that the surface crosses, in order around it: three, or four.
            if len(ins) == 2:
                (a, b), (c, d) = ins, out
                ring = [(a, c), (a, d), (b, d), (b, c)]
            else:
                ring = [(i, o) for i in ins for o in out]
            if turned(tetrahedron, ring, ins, out):
                ring.reverse()
            edges = [np.sort(hit[:, list(e)], 1) @ np.array([side**3, 1]) for e in ring]
            for k in range(1, len(ring) - 1):
                faces.append(np.stack([edges[0], edges[k], edges[k + 1]], 1))
    # Cells in order, so that neighbours are near in the file; the sides are left as they fall.
    faces = np.concatenate(faces)
    faces = faces[np.argsort(faces.min(1), kind="stable")]
    keys, triangles = np.unique(faces, return_inverse=True)
    a, b = np.divmod(keys, side**3)
    weight = (f[a] / (f[a] - f[b]))[:, None]
    place = lambda i: np.stack(np.unravel_index(i, (side,) * 3), 1)
    return arrays(stem, triangles.reshape(-1, 3), place(a) * (1 - weight) + place(b) * weight)


def kept(path):
    """A file as its maker left it."""

    def make(_, stem):
        if not path.endswith(".gz"):
            return [os.path.join(TESTS, path)]
        name = stem + os.path.splitext(path[:-3])[1]
        with gzip.open(os.path.join(KEPT, path)) as packed, open(name, "wb") as file:
            file.write(packed.read())
        return [name]

    return make


def made(*arguments):
    """A mesh of data-gen."""

    def make(data_gen, stem):
        from tools import process

        process.run([data_gen, *arguments, "-o", stem + ".npy"])
        return [stem + ".npy", "--positions", stem + ".G.npy"]

    return make


IRREGULAR = ("sphere", "--diagonals", "0.5")
MIXED = ("--order", "shuffle", "--flip", "0.3")
BLADE = "vtkdata_Apache2/turbineblade.ply"

ALL = [
    Mesh("part", "machined part, STL, welded", True, kept("vtkdata_Apache2/42400-IDGH.stl")),
    Mesh("cycloidal", "CAD assembly, non-manifold edges", True, kept("cycloidal.ply.gz")),
    Mesh("blade", "turbine blade, scan", True, kept(BLADE)),
    Mesh("helens", "terrain, Mount St. Helens", True, helens),
    Mesh("etopo", "relief of the Earth", True, etopo),
    Mesh("gyroid", "isosurface, tetrahedra, noise", False, gyroid),
    Mesh("blobs", "1000 blobs, shuffled, 30 % flipped", False, made("blobs", "-t", "500k", "--blobs", "1000", *MIXED)),
    Mesh("sphere", "displaced sphere, regular", False, made("sphere", "-t", "500k")),
    Mesh("irregular", "displaced sphere, irregular", False, made(*IRREGULAR, "-t", "1M")),
    Mesh("mixed", "the same, shuffled, 30 % flipped", False, made(*IRREGULAR, "-t", "1M", *MIXED)),
    Mesh("irregular8", "displaced sphere, irregular", False, made(*IRREGULAR, "-t", "8M"), large=True),
]
