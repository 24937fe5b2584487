"""A corner table in memory, as one would write it with NumPy and SciPy: `in_memory.py V.npy [G.npy]`.

Opposites by sorting the edges of all corners, components and orientation by one graph search over
the triangles and their reverse sides, outward where a component is closed. Ids of 4 bytes and a
sort that need not be stable, for speed. Prints as JSON the seconds of loading and of the rest, and
counts to hold it to.
"""

import json
import sys
import time

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

NONE = np.uint32(0xFFFFFFFF)


def opposites(v):
    """O, and whether the two triangles run the same way along the edge, by corner pairs."""
    a, b = np.roll(v, -1, 1).ravel(), np.roll(v, -2, 1).ravel()
    key = np.minimum(a, b).astype("u8") << np.uint64(32) | np.maximum(a, b)
    real = np.repeat((v[:, 0] != v[:, 1]) & (v[:, 1] != v[:, 2]) & (v[:, 2] != v[:, 0]), 3)
    corners = np.flatnonzero(real).astype("u4")
    corners = corners[np.argsort(key[corners])]
    key = key[corners]
    first = np.flatnonzero(np.r_[True, key[1:] != key[:-1]][: len(key)])
    size = np.diff(np.r_[first, len(key)])
    pair = first[size == 2]
    one, other = corners[pair], corners[pair + 1]
    o = np.full(v.size, NONE)
    o[one], o[other] = other, one
    same_way = a[one] == a[other]
    return o, one // 3, other // 3, same_way, size


def orient(v, one, other, same_way):
    """The component of each triangle, which triangles to flip for its first to stay, and the
    components that cannot be oriented: those that contain their own reverse side."""
    t = len(v)
    turn = np.where(same_way, np.uint32(t), np.uint32(0))
    rows = np.concatenate([one, one + np.uint32(t)])
    columns = np.concatenate([other + turn, other + np.uint32(t) - turn])
    graph = coo_matrix((np.ones(len(rows), "u1"), (rows, columns)), (2 * t, 2 * t))
    side = connected_components(graph, directed=False)[1]
    front, back = side[:t], side[t:]
    label = np.minimum(front, back)
    _, first, label = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(len(first), "u4")
    rank[np.argsort(first)] = np.arange(len(first), dtype="u4")
    flip = front != front[first][label]
    twisted = front[first] == back[first]
    return rank[label], flip & ~twisted[label], int(twisted.sum())


def outward(v, g, o, label, flip, number):
    """Turns over closed components that enclose less than nothing."""
    closed = np.ones(number, bool)
    closed[label[np.flatnonzero(o == NONE) // 3]] = False
    p = g[v] - g.mean(0)
    six = np.einsum("ij,ij->i", np.cross(p[:, 0], p[:, 1]), p[:, 2])
    volume = np.bincount(label, np.where(flip, -six, six), number)
    return flip ^ (closed & (volume < 0))[label], int(closed.sum())


def apply(v, o, flip):
    """Exchanges corners 1 and 2 of flipped triangles, and every reference to them."""
    v[flip] = v[flip][:, [0, 2, 1]]
    rows = o.reshape(-1, 3)
    rows[flip] = rows[flip][:, [0, 2, 1]]
    place = o % 3
    turned = (o != NONE) & (place != 0)
    turned[turned] = flip[o[turned] // 3]
    o[turned] += np.where(place[turned] == 1, 1, -1).astype("i4").astype("u4")


def main():
    start = time.perf_counter()
    v = np.load(sys.argv[1])
    g = np.load(sys.argv[2]) if len(sys.argv) > 2 else None
    loaded = time.perf_counter()
    o, one, other, same_way, size = opposites(v)
    label, flip, twisted = orient(v, one, other, same_way)
    closed = None
    if g is not None:
        flip, closed = outward(v, g, o, label, flip, int(label.max()) + 1)
    apply(v, o, flip)
    done = time.perf_counter()
    pairs = np.flatnonzero(o != NONE)
    consistent = bool((o[o[pairs]] == pairs).all())
    print(json.dumps({
        "loading": loaded - start,
        "seconds": done - loaded,
        "consistent": consistent,
        "regular_edges": int((size == 2).sum()),
        "border_edges": int((size == 1).sum()),
        "nonmanifold_edges": int((size > 2).sum()),
        "inconsistent_edges": int(same_way.sum()),
        "components": int(label.max()) + 1,
        "nonorientable_components": twisted,
        "closed_components": closed,
        "flipped_triangles": int(flip.sum()),
    }))


if __name__ == "__main__":
    main()
