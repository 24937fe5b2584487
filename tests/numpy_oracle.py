"""Makes meshes of about a million triangles, and checks mesh folders, by NumPy and SciPy alone.

    numpy_oracle.py generate CASE TRIANGLES DIR       writes DIR/V.npy and DIR/G.npy
    numpy_oracle.py check V.npy G.npy OUT.ct          exit 1 with what is wrong
    numpy_oracle.py peak FILE COMMAND...              runs it, writes its peak resident KiB to FILE

Opposites are found by sorting all edges, components by scipy.sparse.csgraph, orientability by the
double cover (each triangle twice, once either way up: a component cannot be oriented when the two
copies of a triangle are connected). Nothing is shared with the program but the documented format.
"""

import json
import os
import sys
from pathlib import Path


def torus(m, n, big, small):
    """2mn triangles, counterclockwise seen from outside, in the order of the grid."""
    import numpy as np

    i, j = np.meshgrid(np.arange(m), np.arange(n))
    a, b = i + m * j, (i + 1) % m + m * j
    d, c = i + m * ((j + 1) % n), (i + 1) % m + m * ((j + 1) % n)
    # Along u then v is inward with these angles, so the quad runs along v first.
    v = np.stack([a, d, c, a, c, b], axis=-1).reshape(-1, 3)
    u, w = 2 * np.pi * i.ravel() / m, 2 * np.pi * j.ravel() / n
    r = big + small * np.cos(u)
    return v, np.stack([r * np.sin(w), r * np.cos(w), small * np.sin(u)], axis=-1)


def moebius(n):
    """2n triangles of a strip that closes turned over."""
    import numpy as np

    i = np.arange(n)
    a, b, c, d = 2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2
    c[-1], d[-1] = 0, 1
    angle, side = np.repeat(2 * np.pi * i / n, 2), np.tile([-0.5, 0.5], n)
    r = 3 + side * np.cos(angle / 2)
    g = np.stack([r * np.cos(angle), r * np.sin(angle), side * np.sin(angle / 2)], axis=-1)
    return np.stack([a, d, c, a, c, b], axis=-1).reshape(-1, 3), g


def side_by_side(parts):
    import numpy as np

    bases = np.cumsum([0] + [len(g) for _, g in parts])
    v = np.concatenate([v + base for (v, _), base in zip(parts, bases)])
    return v, np.concatenate([g for _, g in parts])


def generate(case, triangles, out):
    """coherent: tori in the order of their grids, every third inside out. shuffled: the same in
    random order with 30 % of the triangles turned over. defects: holes, fins, duplicates,
    degenerate triangles, a Moebius strip and unreferenced vertices too."""
    import numpy as np

    random = np.random.default_rng(triangles)
    side = int((triangles * 0.4) ** 0.5)
    parts = [torus(side, side, 10, 4)]
    while sum(len(v) for v, _ in parts) < triangles:
        m, n = random.integers(3, 60, 2)
        v, g = torus(m, n, 2, 0.5)
        if len(parts) % 3 == 1:
            v = v[:, [0, 2, 1]]
        parts.append((v, g + random.uniform(-50, 50, 3)))
    if case == "defects":
        parts.append(moebius(1001))
    v, g = side_by_side(parts)
    g = g + random.normal(0, 0.001, g.shape)
    if case == "defects":
        v = v[random.random(len(v)) > 0.001]
        some = lambda n: v[random.integers(0, len(v), n)]
        fins, flat = some(300), some(200)
        fins[:, 2] = random.integers(0, len(g), 300)
        flat[:, 1] = flat[:, 0]
        v = np.concatenate([v, fins, flat, some(100), some(100)[:, [1, 0, 2]]])
        g = np.concatenate([g, np.full((5, 3), 60.0)])
    if case != "coherent":
        flips = random.random(len(v)) < 0.3
        v[flips] = v[flips][:, [0, 2, 1]]
        v = np.take_along_axis(v, (random.integers(0, 3, (len(v), 1)) + np.arange(3)) % 3, axis=1)
        random.shuffle(v)
        ids = random.permutation(len(g))
        v, moved = ids[v], np.empty_like(g)
        moved[ids] = g
        g = moved
    np.save(Path(out) / "V.npy", v.astype("<u4"))
    np.save(Path(out) / "G.npy", g.astype("<f4"))


class Checker:
    """Compares one folder with what follows from the input; collects every difference."""

    def __init__(self, v_path, g_path, folder):
        import numpy as np

        self.np, self.wrong = np, []
        self.input_v, self.input_g = np.load(v_path), np.load(g_path)
        self.folder = Path(folder)
        self.files = {}
        for path in sorted(self.folder.glob("*.npy")):
            array = np.load(path, mmap_mode="r")
            self.expect(f"{path.name} is mapped", isinstance(array, np.memmap), True)
            self.files[path.stem] = array
        self.counts = json.loads((self.folder / "manifest.json").read_text())["counts"]
        none = np.iinfo(self.files["O"].dtype).max
        widen = lambda a: np.where(a == none, np.iinfo("u8").max, a.astype("u8"))
        self.v, self.o = widen(self.files["V"]).astype("i8"), widen(self.files["O"]).ravel()
        self.label = widen(self.files["component"])
        self.none = np.iinfo("u8").max

    def expect(self, name, found, expected):
        np = self.np
        found, expected = np.asarray(found), np.asarray(expected)
        if found.shape != expected.shape:
            self.wrong.append(f"{name}: shape {found.shape}, expected {expected.shape}")
        elif not np.array_equal(found, expected):
            at = np.argwhere(np.atleast_1d(found != expected))[:5].tolist()
            pairs = [(np.atleast_1d(found)[tuple(i)], np.atleast_1d(expected)[tuple(i)]) for i in at]
            self.wrong.append(f"{name}: differs at {at}, (found, expected) {pairs}")

    def expect_close(self, name, found, expected, slack):
        far = ~(self.np.abs(found - expected) <= slack)
        if far.any():
            at = self.np.flatnonzero(far)[:5]
            self.wrong.append(f"{name}: {found[at]} at {at}, expected {expected[at]}")

    def flips(self):
        """V is the input with the flipped triangles turned over, G the input itself."""
        np = self.np
        bits = np.unpackbits(self.files["flipped"], bitorder="little").astype(bool)
        triangles = len(self.input_v)
        self.expect("bits beyond the last triangle", bits[triangles:].any(), False)
        self.flipped = bits[:triangles]
        turned = np.where(self.flipped[:, None], self.input_v[:, [0, 2, 1]], self.input_v)
        self.expect("V", self.v, turned.astype("i8"))
        self.expect("G", self.files["G"].view("u4"), self.input_g.view("u4"))

    def edges(self):
        """Every corner's edge, grouped by sorting: opposites, borders, cuts."""
        np, v = self.np, self.v
        flat = v.ravel()
        self.degenerate = (v[:, 0] == v[:, 1]) | (v[:, 1] == v[:, 2]) | (v[:, 2] == v[:, 0])
        self.expect("degenerate", self.files["degenerate"], np.flatnonzero(self.degenerate))
        self.a, self.b = np.roll(v, -1, 1).ravel(), np.roll(v, -2, 1).ravel()
        corners = np.flatnonzero(~np.repeat(self.degenerate, 3))
        lo, hi = np.minimum(self.a, self.b), np.maximum(self.a, self.b)
        key = lo * (flat.max(initial=0) + 1) + hi
        corners = corners[np.argsort(key[corners], kind="stable")]
        sorted_key = key[corners]
        first = np.flatnonzero(np.r_[True, sorted_key[1:] != sorted_key[:-1]][: len(corners)])
        size = np.diff(np.r_[first, len(corners)])
        of_corner = np.zeros(len(flat), "i8")
        of_corner[corners] = np.repeat(size, size)
        self.size = of_corner
        one, other = corners[first[size == 2]], corners[first[size == 2] + 1]
        opposite = np.full(len(flat), self.none)
        opposite[one], opposite[other] = other, one
        self.expect("O", self.o, opposite)
        self.links = one, other
        cut = size > 2
        table = self.files["nonmanifold_edges"]
        starts = corners[first[cut]]
        for name, column in [("lo", lo[starts]), ("hi", hi[starts]), ("corners", size[cut])]:
            self.expect(name, table[name], column)
        self.expect("first_corner", table["first_corner"], starts)
        self.expect("nonmanifold_corners", self.files["nonmanifold_corners"], corners[np.repeat(size, size) > 2])
        turned = self.flipped[one // 3] ^ self.flipped[other // 3]
        self.odd = self.a[one] != self.b[other]
        number = lambda name, n: self.expect(name, self.counts[name], n)
        number("distinct_edges", len(first))
        number("regular_edges", (size == 2).sum())
        number("border_edges", (size == 1).sum())
        number("nonmanifold_edges", cut.sum())
        number("nonmanifold_corners", size[cut].sum())
        number("inconsistent_edges", (self.odd ^ turned).sum())
        number("degenerate", self.degenerate.sum())
        number("triangles", len(v))
        number("vertices", len(self.input_g))
        number("unreferenced_vertices", len(self.input_g) - len(np.unique(flat)))
        number("flipped_triangles", self.flipped.sum())

    def components(self):
        """Labels by graph search, numbered by first triangle; orientability by the double cover."""
        np = self.np
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components

        def connect(nodes, one, other):
            ones = np.ones(len(one), "u1")
            return connected_components(coo_matrix((ones, (one, other)), (nodes, nodes)), False)[1]

        triangles = len(self.v)
        one, other = self.links[0] // 3, self.links[1] // 3
        real = np.flatnonzero(~self.degenerate)
        found = connect(triangles, one, other)[real]
        _, first, inverse = np.unique(found, return_index=True, return_inverse=True)
        rank = np.empty(len(first), "i8")
        order = np.argsort(first)
        rank[order] = np.arange(len(first))
        label = np.full(triangles, self.none)
        label[real] = rank[inverse]
        self.expect("component", self.label, label)
        self.real, self.of = real, label[real].astype("i8")
        self.first = real[first[order]]
        odd = self.odd * triangles
        cover = connect(2 * triangles, np.r_[one, one + triangles],
                        np.r_[other + odd, (other + triangles - odd)])
        self.orientable = cover[self.first] != cover[self.first + triangles]

    def table(self):
        """The counts of each component, its sums, and the choice of its orientation."""
        np, table = self.np, self.files["components"]
        number = len(self.first)
        tally = lambda mask: np.bincount(self.of, mask.reshape(-1, 3).sum(1)[self.real], number).astype("i8")
        border, paired, cut = tally(self.size == 1), tally(self.size == 2), tally(self.size > 2)
        triangles = np.bincount(self.of, minlength=number)
        flipped = np.bincount(self.of, self.flipped[self.real], number).astype("i8")
        closed = border + cut == 0
        watertight = closed | ((border == 0) & self.cuts_cancel(number))
        columns = dict(first_triangle=self.first, triangles=triangles, flipped=flipped, edges=paired // 2 + border + cut,
                       border_edges=border, cut_edges=cut, orientable=self.orientable, closed=closed,
                       watertight=watertight)
        for name, column in columns.items():
            self.expect(f"components.{name}", table[name], column)
        volume, slack = self.sums(number)
        by_volume = self.orientable & watertight
        for c in np.flatnonzero(by_volume & (np.abs(volume) <= slack)):
            by_volume[c] = self.exact_volume(c) != 0
            self.expect(f"component {c} is so small that its sign is unclear", by_volume[c], False)
        self.expect("components.outward", table["outward"], by_volume)
        self.expect("volumes of outward components are positive", (volume[by_volume] > 0).all(), True)
        odd = np.bincount(self.of[np.searchsorted(self.real, self.links[0] // 3)], self.odd, number)
        self.expect("edges that disagree", odd[self.orientable].any(), False)
        self.expect("flips of what cannot be oriented", flipped[~self.orientable].any(), False)
        rest = self.orientable & ~by_volume
        minority = (2 * flipped < triangles) | ((2 * flipped == triangles) & ~self.flipped[self.first])
        self.expect("the minority is flipped", minority[rest].all(), True)
        for name, n in [("components", number), ("nonorientable_components", (~self.orientable).sum()),
                        ("closed_components", closed.sum()), ("watertight_components", watertight.sum()),
                        ("flipped_components", (flipped == triangles).sum())]:
            self.expect(name, self.counts[name], n)

    def cuts_cancel(self, number):
        """At each non-manifold edge, each component's own corners run as often up as down."""
        np = self.np
        corners = np.flatnonzero(self.size > 2)
        of = self.label[corners // 3].astype("i8")
        lo, hi = np.minimum(self.a, self.b)[corners], np.maximum(self.a, self.b)[corners]
        rows, inverse = np.unique(np.stack([of, lo, hi], 1), axis=0, return_inverse=True)
        up = np.where(self.a[corners] < self.b[corners], 1, -1)
        balance = np.bincount(inverse.ravel(), up, len(rows))
        return np.bincount(rows[:, 0], balance != 0, number) == 0

    def exact_volume(self, c):
        """Six times the volume in steps of the grid, in Python's integers."""
        np = self.np
        g = np.asarray(self.files["G"], "f8")
        low, extent = g.min(0), np.ptp(g, axis=0).max()
        grid = np.round((g - low) / 2 ** np.ceil(np.log2(extent / 2**30))).astype("i8").astype(object)
        a, b, c = grid[self.v[self.label == c]].transpose(1, 2, 0)
        return ((a[1] * b[2] - a[2] * b[1]) * c[0] + (a[2] * b[0] - a[0] * b[2]) * c[1]
                + (a[0] * b[1] - a[1] * b[0]) * c[2]).sum()

    def sums(self, number):
        """Volumes and areas in f64; the program's are exact on a grid of 2^30 steps."""
        np, table = self.np, self.files["components"]
        g = np.asarray(self.files["G"], "f8")
        low, extent = g.min(0), np.ptp(g, axis=0).max()
        p = (g - low)[self.v[self.real]]
        cross = np.cross(p[:, 0], p[:, 1])
        volume = np.bincount(self.of, (cross * p[:, 2]).sum(1), number)
        # Moving a corner moves its product by at most the distance, a grid step or two, times
        # the box's diagonal times the edge across; the rest is the rounding of these sums.
        edges = np.abs(p - np.roll(p, 1, 1)).sum((1, 2))
        slack = np.bincount(self.of, edges, number) * extent**2 * 2.0**-26
        slack += np.bincount(self.of, minlength=number) * extent**3 * 1e-14
        self.expect_close("six_volume", table["six_volume"], volume, slack)
        area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2
        area = np.bincount(self.of, area, number)
        self.expect_close("area", table["area"], area, 1e-6 * area.max())
        order = np.argsort(self.of, kind="stable")
        points = g[self.v[self.real][order]].reshape(-1, 3)
        starts = 3 * np.searchsorted(self.of[order], np.arange(number))
        self.expect("bbox_min", table["bbox_min"], np.minimum.reduceat(points, starts))
        self.expect("bbox_max", table["bbox_max"], np.maximum.reduceat(points, starts))
        return volume, slack


def check(v_path, g_path, folder):
    checker = Checker(v_path, g_path, folder)
    for step in [checker.flips, checker.edges, checker.components, checker.table]:
        step()
        # Each step builds on what the one before found right.
        if checker.wrong:
            break
    print("\n".join(checker.wrong) or f"{len(checker.v)} triangles: right")
    return 1 if checker.wrong else 0


def peak(file, command):
    """The child starts from a small interpreter: NumPy is not imported here, since what a process
    had resident before it becomes the command would count."""
    pid = os.posix_spawn(command[0], command, os.environ)
    _, status, usage = os.wait4(pid, 0)
    Path(file).write_text(str(usage.ru_maxrss))
    return os.waitstatus_to_exitcode(status)


def main():
    verb, *rest = sys.argv[1:]
    if verb == "generate":
        return generate(rest[0], int(rest[1]), rest[2])
    if verb == "check":
        return check(*rest)
    if verb == "peak":
        return peak(rest[0], rest[1:])
    return f"no verb {verb}"


if __name__ == "__main__":
    sys.exit(main())
