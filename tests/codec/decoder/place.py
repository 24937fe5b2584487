"""Sections 5 and 6 of `docs/format.md`: the positions of vertices."""

from math import isqrt

from bits import LIST, LISTED, LONE, RESIDUAL, STEP, held, log4, over


def dot(u, v):
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def cross(u, v):
    return (
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    )


def less(u, v):
    return u[0] - v[0], u[1] - v[1], u[2] - v[2]


def add(u, v):
    return u[0] + v[0], u[1] + v[1], u[2] + v[2]


def times(n, v):
    return n * v[0], n * v[1], n * v[2]


def shifted(n, *vectors):
    """How far the vectors are shifted down to n bits, and they."""
    most = max(abs(x) for v in vectors for x in v)
    off = max(0, most.bit_length() - n)
    return off, [tuple(x >> off for x in v) for v in vectors]


def log4_of_square(v):
    off, (v,) = shifted(29, v)
    return log4(dot(v, v)) + 8 * off


def unit(v):
    _, (v,) = shifted(30, v)
    length = isqrt(dot(v, v))
    return tuple(over(x << 20, length) for x in v) if length else (0, 0, 0)


PAIRS = (0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3), (0, 4), (1, 4), (2, 4), (3, 4)
TIPS = "TRL", "TLG", "TRF", "TRLFG"
HALVES = {"T": {0: 1}, "R": {1: 1}, "L": {2: 1}, "F": {3: 1, 7: 1}, "G": {4: 1, 7: -1}}


class Set:
    """The two ways to weigh the eleven features, of one pair and two bends."""

    def __init__(self, tips):
        self.start = [0] * 11
        for tip in tips:
            for feature, sign in HALVES[tip].items():
                self.start[feature] += sign * 32768
        self.learned, self.missed = self.start, [0, 0]
        self.matrix, self.right = [[0] * 11 for _ in range(11)], [0] * 11
        self.count, self.wait = 0, 16

    def uses_learned(self):
        return self.missed[1] < self.missed[0] + 65536

    def weights(self):
        return self.learned if self.uses_learned() else self.start

    def learn(self, features, target):
        _, (*f, target) = shifted(18, *features, target)
        misses = []
        for weights in self.start, self.learned:
            sums = [sum(w * x[axis] for w, x in zip(weights, f)) >> 16 for axis in range(3)]
            o = less(target, sums)
            misses.append(dot(o, o))
        size = dot(f[0], f[0])
        u = misses[self.uses_learned()] | size >> 16 | 4
        self.missed = [m + ((log4(o | 1) << 16) - m >> 4) for m, o in zip(self.missed, misses)]
        w = (size.bit_length() + u.bit_length()) // 2
        for i in range(11):
            for j in range(11):
                self.matrix[i][j] += dot(f[i], f[j]) << 12 >> w
            self.right[i] += dot(f[i], target) << 12 >> w
        self.count += 1
        if self.count == 8192:
            self.count //= 2
            self.matrix = [[over(x, 2) for x in row] for row in self.matrix]
            self.right = [over(x, 2) for x in self.right]
        self.wait -= 1
        if self.wait == 0:
            self.wait = held(self.count, 16, 256)
            self.solve()

    def solve(self):
        matrix = [[x << 16 for x in row] for row in self.matrix]
        right = [(x << 16) + (s << 12) for x, s in zip(self.right, self.start)]
        for i in range(11):
            matrix[i][i] += 1 << 28
        for k, pivot in enumerate(matrix):
            if pivot[k] <= 0:
                return
            for i in range(k + 1, 11):
                factor = over(matrix[i][k] << 32, pivot[k])
                for j in range(k, 11):
                    matrix[i][j] -= factor * pivot[j] >> 32
                right[i] -= factor * right[k] >> 32
        weights = [0] * 11
        for k in reversed(range(11)):
            rest = sum(matrix[k][j] * weights[j] for j in range(k + 1, 11))
            weights[k] = held(over((right[k] << 16) - rest, matrix[k][k]), -(1 << 19), 1 << 19)
        self.learned = weights


class Positions:
    """The vertices of a chunk: points, how rough it was at each, on which lists they were."""

    def __init__(self, coder):
        self.coder = coder
        self.points, self.rough, self.listed = [], [], []
        self.lists, self.sets, self.tracks = [[], [], []], {}, {}

    def read_lists(self, vertices):
        for values in self.lists:
            count = self.coder.magnitude(LIST, 0, 0)
            assert 4 * count <= vertices, f"a list of {count} values for {vertices} vertices"
            last, start = 0, 31
            for _ in range(count):
                step = self.coder.plain_number(LIST, 1, start)
                last, start = last + step, min(31, abs(step).bit_length())
                values.append(last)

    def lone(self, context):
        point = self.points[-1] if self.points else (0, 0, 0)
        steps = [self.coder.plain_number(LONE, axis + context, 8) for axis in range(3)]
        self.keep(add(point, steps), 6, 0)

    def keep(self, point, rough, listed):
        self.points.append(point)
        self.rough.append(rough)
        self.listed.append(listed)

    def border(self, e, g, l):
        """The vertices about a gate, before a tip comes, and its bends."""
        d, f = e.previous, e.next
        names = {"a": e.origin, "b": f.origin, "c": f.end(), "d": f.next.end()}
        names |= {"z": d.origin, "y": d.previous.origin, "p": e.apex, "q": e.far}
        names |= {"r": f.apex, "s": f.far, "l": d.apex, "k": d.far}
        return names, [(gap > 9) + (gap > 14) for gap in (g, l)]

    def place(self, border, fan):
        self.keep(*Position(self, *border, fan).decode())


def signed(x, logarithm, least, width, levels):
    return 2 * held(over(2 * log4(abs(x)) - logarithm + least, width), 0, levels) + (x < 0)


class Position:
    """One vertex that is not alone. Fan is its class."""

    def __init__(self, places, names, bends, fan):
        self.places, self.coder, self.names, self.fan = places, places.coder, names, fan
        a, b, c, d, z, y, p, q, r, s, l, k = (places.points[names[n]] for n in "abcdzypqrslk")
        m = self.m = add(a, b)
        # Agreement
        self.tips = {"T": less(m, p), "R": less(add(b, c), r), "L": less(add(z, a), l)}
        self.tips |= {"F": less(add(a, c), b), "G": less(add(b, z), a)}
        tips = [self.tips[name] for name in TIPS[fan]]
        aparts = [log4_of_square(less(tips[i], tips[j])) for i, j in PAIRS[: 10 if fan == 3 else 3]]
        apart = min(aparts)
        best = aparts.index(apart)
        pair = 3 * fan + best
        # Guess
        around = [self.tips[name] for name in "TRL"] + [c, z, d, y]
        self.features = [less(times(2, v), m) for v in around] + [times(2, less(a, b))]
        self.features += [less(times(2, v), m) for v in (q, s, k)]
        way = 2 * pair + (names["a"] > names["c"])
        which = 9 * way + 3 * bends[0] + bends[1]
        if which not in places.sets:
            places.sets[which] = Set("TT" if fan == 0 else [TIPS[fan][i] for i in PAIRS[best]])
        self.set = places.sets[which]
        sums = [
            sum(w * f[axis] for w, f in zip(self.set.weights(), self.features)) for axis in range(3)
        ]
        self.guess = [held((x << 7) + (y >> 9), -(1 << 41), 1 << 41) for x, y in zip(m, sums)]
        # Size and frame
        self.off, sides = shifted(24, less(b, a), less(p, a), less(p, b))
        self.s = max(1, sum(dot(v, v) for v in sides))
        self.size = self.s << 2 * self.off
        corners = less(a, p), less(b, p), less(b, r), less(c, r), less(z, l), less(a, l)
        _, (i, j, k, t, u, v) = shifted(28, *corners)
        n = unit(add(add(cross(i, j), cross(k, t)), cross(u, v)))
        if n == (0, 0, 0):
            n = 0, 0, 1 << 20
        x, y, z = (abs(x) for x in n)
        self.order = (0, 1, 2) if z >= max(x, y) else (0, 2, 1) if y >= x else (1, 2, 0)
        t = unit(less(b, a))
        along = dot(t, n) >> 20
        t = unit(less(t, [x * along >> 20 for x in n]))
        if t == (0, 0, 0):
            t = unit(cross(n, [(i == self.order[0]) << 20 for i in range(3)]))
        self.frame = t, tuple(x >> 20 for x in cross(n, t)), n
        # The track of the spread
        a, b, p, c = (places.rough[names[n]] for n in "abpc")
        self.rough = (2 * (a + b) + p + c + 3) // 6
        far = held(over(apart - log4(self.s) - 8 * self.off + 48, 8), 0, 7)
        start = [1 << 17, 1 << 17, 1 << 15, 0]
        self.track = places.tracks.setdefault((way, far, self.rough), start)

    def spread(self):
        """The logarithms of the axes in turn, and how much each miss tells of later ones."""
        down, (v,) = shifted(30, [mean * self.s >> 8 for mean in self.track[:3]])
        shift = down + 2 * self.off
        g, most = 5461 >> min(shift, 40), 1 << 26

        def c(i, j):
            i, j = self.order[i], self.order[j]
            rows = zip(v, self.frame)
            return sum(max(1, x) * (e[i] * e[j] >> 20) >> 20 for x, e in rows) + (g + 1) * (i == j)

        def share(x, y):
            return held(over(x << 20, y), -most, most)

        d0 = max(1, c(0, 0))
        f10, f20 = share(c(1, 0), d0), share(c(2, 0), d0)
        d1 = max(g + 1, c(1, 1) - (f10 * c(1, 0) >> 20))
        h = c(2, 1) - (f20 * c(1, 0) >> 20)
        f21 = share(h, d1)
        d2 = max(g + 1, c(2, 2) - (f20 * c(2, 0) >> 20) - (f21 * h >> 20))
        return [log4(d) + 4 * shift for d in (d0, d1, d2)], ((), (f10,), (f20, f21))

    def decode(self):
        logarithms, shares = self.spread()
        place, missed = [0] * 3, []
        self.past = self.listed = self.unlisted = 0
        most = (1 << 35) - (1 << 31) - 1 << 8
        for k, axis in enumerate(self.order):
            expected = self.guess[axis] + sum(f * i >> 20 for f, i in zip(shares[k], missed))
            expected = held(expected, -most, most)
            L = logarithms[k]
            x = self.from_list(k, axis, L, expected)
            if x is None:
                self.unlisted += 1
                x = self.residual(k, axis, L, expected)
            place[axis] = x
            missed.append((x << 8) - expected)
            past = held(over(2 * log4(abs(missed[k])) - L + 16, 6), 0, 7)
            self.past = self.past << 3 | past
        return tuple(place), self.learn(place), self.listed

    def from_list(self, k, axis, L, expected):
        values = self.places.lists[axis]
        if not values:
            return None
        whole = expected >> 8
        near = min(range(len(values)), key=lambda i: (abs(values[i] - whole), -i))
        low, high = max(0, near - 1), min(len(values) - 1, near + 1)
        width = max(1, (values[high] - values[low]) // max(1, high - low))
        off = expected - (values[near] << 8)
        far = held(2 * log4(abs(off)) - L + 12, 0, 27) // 4
        p, a, b = (self.places.listed[self.names[n]] for n in "pab")
        same = (p >> axis & 1) << 2 | (a >> axis & 1) << 1 | b >> axis & 1
        around = p << 6 | a << 3 | b
        mask = 16 * self.listed + axis
        spread = held(L - 2 * log4(width) + 64, 0, 127)
        eight = [
            mask << 16 | around,
            mask << 8 | far,
            mask << 16 | (around & 63) << 8 | far,
            mask << 8 | spread // 2,
            around << 2 | k,
            mask,
            mask | 1 << 20,
            mask | 1 << 21,
        ]
        context = ((3 * k + self.unlisted) * 8 + same) * 8 + far, 8 * same + far, eight
        if not self.coder.decide(LISTED, context):
            return None
        hint = held(over(4 * off, 256 * width) + 4, 0, 7)
        eight = [
            mask << 16 | around,
            mask << 12 | spread << 4 | hint,
            mask << 16 | (around & 63) << 8 | hint,
            spread << 2 | k,
            near << 2 | axis,
            mask << 4 | hint,
            mask | 1 << 20,
            mask | 1 << 21,
        ]
        main = 64 * k + 8 * min(spread // 4, 7) + hint
        self.listed |= 1 << axis
        at = near + self.coder.number(STEP, (main, 0, eight), 0, hint)
        assert 0 <= at < len(values), f"value {at} of a list of {len(values)}"
        return values[at]

    def residual(self, k, axis, L, expected):
        guess, fan, past = self.guess[axis], self.fan, self.past
        gate, right, left = ((self.tips[name][axis] << 8) - guess for name in "TRL")
        if L > 72:
            hint = signed({1: left, 2: right}.get(fan, gate), L, 16, 8, 3)
        else:
            hint = (expected + 128 & 255) >> 5
        bucket = held(over(L - 48, 4), 0, 63)
        tip = signed(gate, L, 20, 4, 11)
        both = signed(right + left >> 1, L, 20, 4, 11)
        right, left = signed(right, L, 20, 4, 11), signed(left, L, 20, 4, 11)
        beside = (both, left, right, right | left << 6)[fan]
        eight = [
            held(L - 48, 0, 255) << 2 | k,
            bucket // 2 << 8 | past << 2 | k,
            bucket << 8 | self.rough << 4 | fan << 2,
            bucket << 5 | hint << 2 | k,
            bucket << 2 | axis,
            bucket // 2 << 8 | self.rough << 4 | k,
            tip << 16 | bucket << 4 | k,
            beside << 12 | tip << 6 | bucket // 4 << 2 | k,
        ]
        e = ((past & 7) + 2) // 3 if k else 0
        start = held(over(L - 60, 8), 0, 30)
        context = 64 * (3 * e + k) + bucket, 0, eight
        return (expected + 128 >> 8) + self.coder.number(RESIDUAL, context, start, hint)

    def learn(self, place):
        """Learns the vertex, and gives how rough it was."""
        most, track = 1 << 40, self.track
        whole = [(x << 8) - guess for x, guess in zip(place, self.guess)]
        miss = [held(x, -most, most) for x in whole]
        rate = min(40, track[3] // 2 + 2)
        for i, e in enumerate(self.frame):
            x = sum(miss[axis] * e[axis] >> 20 for axis in range(3))
            y = min((x * x << 8) // self.size, 16 * track[i] + 256)
            track[i] = held(track[i] + over(y - track[i], rate), 16, most)
        track[3] += 1
        self.set.learn(self.features, less(times(2, place), self.m))
        size = (self.size | 1).bit_length() - 1
        return held(over(log4_of_square(whole) - 4 * size + 24, 8), 0, 11)
