"""Whether a compressed file gave back what went in: triangles as integers, compared as a multiset.

Vertices have other numbers after compression and triangles another order, so a triangle is known by
the grid nodes of its three corners, in turn from the least. Two meshes are the same when the
sorted lists of these are. This shares nothing with Cornermill or Draco but the formula of the grid:
node = floor((x - least) / step + 1/2), step = largest extent / (2^bits - 1).
"""

import numpy as np


def folder(path):
    """V and G of a mesh folder."""
    return np.load(f"{path}/V.npy", mmap_mode="r").reshape(-1, 3), np.load(f"{path}/G.npy", mmap_mode="r")


def ply(path):
    """V and G of a binary PLY of x, y, z as floats and triangles, and nothing else."""
    with open(path, "rb") as file:
        counts = {}
        while (line := file.readline().split()) != [b"end_header"]:
            if line[:1] == [b"element"]:
                counts[line[1]] = int(line[2])
        g = np.fromfile(file, "<f4", 3 * counts[b"vertex"]).reshape(-1, 3)
        face = np.dtype([("n", "u1"), ("v", "<u4", 3)])
        faces = np.fromfile(file, face, counts[b"face"])
    if len(faces) != counts[b"face"] or not (faces["n"] == 3).all():
        raise ValueError(f"{path}: faces that are no triangles, or too few")
    return faces["v"], g


class Grid:
    """The grid over the vertices that are encoded."""

    def __init__(self, g, bits):
        self.least = g.min(0).astype(float)
        self.step = (g.max(0).astype(float) - self.least).max() / (2**bits - 1)

    def nodes(self, g):
        return np.floor((g.astype(float) - self.least) / self.step + 0.5).astype(np.int64)


def keys(v, nodes):
    """A sorted row for each triangle: its corners' nodes, turned so that the least comes first."""
    if len(v) == 0:
        return np.zeros((0, 3), np.int64)
    node = ((nodes[:, 0] << 42) + (nodes[:, 1] << 21) + nodes[:, 2])[v]
    first = node.argmin(1)
    turn = (first[:, None] + np.arange(3)) % 3
    rows = np.take_along_axis(node, turn, 1)
    # Of equal least nodes the turn that is smallest in all.
    other = np.roll(rows, -1, 1)
    for _ in range(2):
        less = (other[:, 0] == rows[:, 0]) & (
            (other[:, 1] < rows[:, 1]) | ((other[:, 1] == rows[:, 1]) & (other[:, 2] < rows[:, 2]))
        )
        rows = np.where(less[:, None], other, rows)
        other = np.roll(other, -1, 1)
    return rows[np.lexsort((rows[:, 2], rows[:, 1], rows[:, 0]))]


def differing(a, b):
    """Triangles that the first list has and the second has not, counting repeats, and the other way."""
    if a.shape == b.shape and (a == b).all():
        return 0, 0
    rows, which = np.unique(np.concatenate([a, b]), axis=0, return_inverse=True)
    more = np.bincount(which[: len(a)].ravel(), minlength=len(rows))
    more = more - np.bincount(which[len(a) :].ravel(), minlength=len(rows))
    return int(more[more > 0].sum()), int(-more[more < 0].sum())


def flat(rows):
    """Triangles of which two corners fell on one node: Draco drops those, as it may."""
    return (rows[:, 0] == rows[:, 1]) | (rows[:, 1] == rows[:, 2]) | (rows[:, 0] == rows[:, 2])


def self_test():
    """The comparison must see what is the same, and each way of not being the same."""
    random = np.random.default_rng(1)
    g = random.random((500, 3))
    nodes = Grid(g, 14).nodes(g)
    v = np.sort(np.array([random.choice(500, 3, replace=False) for _ in range(900)]), 1)
    whole = keys(v, nodes)
    turned = np.stack([np.roll(row, k % 3) for k, row in enumerate(random.permutation(v))])
    other = random.permutation(500)
    assert differing(whole, keys(np.argsort(other)[turned], nodes[other])) == (0, 0), "the same, by other numbers"
    flipped = v.copy()
    flipped[5] = flipped[5, ::-1]
    assert differing(whole, keys(flipped, nodes)) == (1, 1), "one triangle flipped"
    assert differing(whole, keys(v[1:], nodes)) == (1, 0), "one triangle lost"
    assert differing(whole, keys(np.vstack([v, v[:1]]), nodes)) == (0, 1), "one triangle twice"
    moved = nodes.copy()
    moved[v[0, 0], 1] += 1
    assert min(differing(whole, keys(v, moved))) >= 1, "a vertex moved by a step"


if __name__ == "__main__":
    self_test()
    print("the comparison sees every difference")
