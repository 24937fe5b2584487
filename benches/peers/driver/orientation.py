"""Judges an orientation: `orientation.py V.npy G.npy ORIENTED.npy [REFERENCE.npy]`, prints JSON.

Right means: the triangles of V (less those with a repeated vertex) in the same order with the same
vertices, and along every regular edge of an orientable component the two triangles run in opposite
directions. Outward means that, and every closed component encloses more than nothing.

The reference is V before any triangle was flipped, coherent and outward. Where the oriented triangles
are those of the reference, turned or not, nothing need be sorted; else the edges are.
"""

import json
import sys

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


def real(v):
    bad = (v[:, 0] == v[:, 1]) | (v[:, 1] == v[:, 2]) | (v[:, 2] == v[:, 0])
    return v[~bad] if bad.any() else v


def parity(a, b, step=1 << 20):
    """Per triangle 0 when b is a turned, 1 when it is flipped, 2 when it is another triangle."""
    out = np.full(len(a), 2, "u1")
    for i in range(0, len(a), step):
        x, y, o = a[i : i + step], b[i : i + step], out[i : i + step]
        for k in range(3):
            z = np.roll(y, k, 1)
            o[(x == z).all(1)] = 0
            o[(x == z[:, [0, 2, 1]]).all(1)] = 1
    return out


def edges(v):
    """Pairs of triangles across regular edges, whether they agree, and which triangles have other edges."""
    a, b = np.roll(v, -1, 1).ravel(), np.roll(v, -2, 1).ravel()
    key = np.minimum(a, b).astype("u8") << np.uint64(32) | np.maximum(a, b)
    order = np.argsort(key)
    key = key[order]
    first = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    size = np.diff(np.r_[first, len(key)])
    pair = first[size == 2]
    one, other = order[pair], order[pair + 1]
    open_triangles = order[np.repeat(size != 2, size)] // 3
    return one // 3, other // 3, a[one] != a[other], open_triangles


def judge(v, g, oriented, reference):
    if len(v) != len(oriented):
        return wrong(f"{len(oriented)} triangles of {len(v)}"), wrong("not all triangles are there")
    if reference is not None:
        against = parity(reference, oriented)
        if (against == 2).any():
            return other(against)
        if (against == against[0]).all():
            right = {"verdict": "right", "found": 0, "expected": 0}
            return right, right if against[0] == 0 else wrong("all inward")
    elif (parity(v, oriented) == 2).any():
        return other(parity(v, oriented))
    one, far, agree, open_triangles = edges(oriented)
    turn = np.where(agree, 0, len(v))
    rows, columns = np.r_[one, one + len(v)], np.r_[far + turn, far + len(v) - turn]
    side = connected_components(coo_matrix((np.ones(len(rows), "u1"), (rows, columns)), (2 * len(v),) * 2), directed=False)[1]
    twisted = side[: len(v)] == side[len(v) :]
    bad = int((~agree & ~twisted[one]).sum())
    if bad:
        return {"verdict": "wrong", "found": bad, "expected": 0, "of": "inconsistent edges"}, wrong("not consistent")
    graph = coo_matrix((np.ones(len(one), "u1"), (one, far)), (len(v),) * 2)
    number, label = connected_components(graph, directed=False)
    closed = np.ones(number, bool)
    closed[label[open_triangles]] = False
    closed[label[twisted]] = False
    p = (g.astype("f8") - g.mean(0))[oriented]
    six = np.einsum("ij,ij->i", np.cross(p[:, 0], p[:, 1]), p[:, 2])
    inward = int((closed & (np.bincount(label, six, number) < 0)).sum())
    right = {"verdict": "right", "found": 0, "expected": 0}
    if not closed.any():
        return right, {"verdict": "none is closed"}
    return right, right if not inward else wrong(f"{inward} of {int(closed.sum())} closed components inward")


def wrong(what):
    return {"verdict": "wrong", "found": what}


def other(against):
    text = f"{int((against == 2).sum())} triangles have other vertices"
    return wrong(text), wrong(text)


def main():
    v, g, oriented = real(np.load(sys.argv[1])), np.load(sys.argv[2]), real(np.load(sys.argv[3]))
    reference = real(np.load(sys.argv[4])) if len(sys.argv) > 4 else None
    consistent, outward = judge(v, g, oriented, reference)
    print(json.dumps({"orientation": consistent, "outward": outward}))


if __name__ == "__main__":
    main()
