"""Sections 2 and 3 of `docs/format.md`: bits, probabilities, numbers; and arithmetic that all use."""

MASK = (1 << 64) - 1
RIGHT, LEFT, BORDER, NEW, SEEN, FAN_RIGHT, FAN_LEFT, ZIP, REVERSED, LINK = range(10)
BACK, LONE, RESIDUAL, LISTED, STEP, LIST, REFERENCE, LABEL, NUMBER, TURN = range(10, 20)


def held(x, least, most):
    return least if x < least else most if x > most else x


def over(x, y):
    """x / y toward zero, y above 0."""
    return x // y if x >= 0 else -(-x // y)


def log4(x):
    if x == 0:
        return 0
    p = x.bit_length() - 1
    return 4 * p + ((x << 2 >> p) & 3)


class Bits:
    def __init__(self, data):
        self.data, self.at = data, 5
        self.range, self.code = (1 << 32) - 1, int.from_bytes(data[:5], "big")

    def bit(self, p):
        bound = (self.range >> 16) * p
        one = self.code < bound
        if one:
            self.range = bound
        else:
            self.code -= bound
            self.range -= bound
        while self.range < 1 << 24:
            self.range <<= 8
            self.code = self.code << 8 | self.data[self.at]
            self.at += 1
        return int(one)

    def plain(self, count):
        x = 0
        for _ in range(count):
            x = x << 1 | self.bit(32768)
        return x

    def end(self):
        assert self.at == len(self.data), f"{self.at} of {len(self.data)} bytes were read"


def between(known, x):
    i, part = (x >> 7) + 16, x & 127
    return (known[i] * (128 - part) + known[min(i + 1, 32)] * part + 64) >> 7


def stretches(known):
    table, x = [], -2047
    for q in range(4096):
        while x < 2047 and between(known, x) < q:
            x += 1
        table.append(x)
    return table


SQUASH = (
    (22, 36, 60, 98, 162, 267, 439, 720, 1179, 1921, 3108, 4971, 7812, 11955, 17625, 24743, 32768)
    + (40793, 47911, 53581, 57724, 60565, 62428, 63615, 64357, 64816, 65097, 65269, 65374, 65438)
    + (65476, 65500, 65514)
)
STRETCH = stretches(
    (1, 2, 3, 6, 10, 16, 27, 45, 73, 120, 194, 310, 488, 747, 1101, 1546, 2047, 2549, 2994, 3348)
    + (3607, 3785, 3901, 3975, 4022, 4050, 4068, 4079, 4085, 4089, 4092, 4093, 4094)
)
RATE = [655360 // (10 * n + 16) for n in range(161)]


def learn(cell, bit, limit):
    p, n = cell
    cell[0] = p + (((65535 if bit else 0) - p) * RATE[n] >> 16)
    cell[1] = min(n + 1, limit)


class Weights:
    def __init__(self):
        self.w, self.learned = [10485] * 10, 0

    def sum(self, inputs):
        return held(sum(w * i for w, i in zip(self.w, inputs)) >> 16, -2047, 2047)

    def learn(self, inputs, x, bit):
        r = 13 if self.learned < 1024 else 14 if self.learned < 8192 else 15
        error, half = (65535 if bit else 0) - between(SQUASH, x), 1 << (r - 1)
        self.w = [w + (i * error + half >> r) for w, i in zip(self.w, inputs)]
        self.learned += 1


class Coder:
    """Decisions and numbers from a stream. A context is (main, kin, the eight of strong)."""

    def __init__(self, data, strong):
        self.bits, self.strong = Bits(data), strong
        self.cells, self.kins, self.weights = {}, {}, {}
        self.tables = [{} for _ in range(8)]
        self.limit = 120 if strong else 160

    def decide(self, family, context, bin=0, kin=None, sign=0):
        main, own_kin, eight = context
        kins = self.kins.setdefault((family, own_kin if kin is None else kin), [32768, 0])
        cell = self.cells.setdefault((family, main, bin), [32768, 0])
        if cell[1] == 0:
            cell[:] = kins[0], min(kins[1], 3)
        if self.strong:
            bit = self.mixed(cell, family, main, bin, sign, eight or [main] * 8)
        else:
            bit = self.bits.bit(held(cell[0], 24, 65512))
        if self.strong or cell[1] < 40:
            learn(kins, bit, self.limit)
        learn(cell, bit, self.limit)
        return bit

    def mixed(self, cell, family, main, bin, sign, eight):
        key = sign << 13 | family << 8 | bin
        cells = []
        for table, c in zip(self.tables, eight):
            h = (c << 20 | key) * 0x9E3779B97F4A7C15 & MASK
            h = ((h ^ h >> 29) * 0xBF58476D1CE4E5B9 & MASK) >> 48
            cells.append(table.setdefault(h, [32768, 0]))
        inputs = [
            over(STRETCH[held(p, 24, 65512) >> 4] * (min(n, 12) + 4), 16) for p, n in cells + [cell]
        ]
        inputs.append(256)
        sets = [
            self.weights.setdefault(key, Weights())
            for key in ((family, "bin", bin), (family, "main", main % 160))
        ]
        sums = [s.sum(inputs) for s in sets]
        bit = self.bits.bit(held(between(SQUASH, sum(sums) >> 1), 24, 65512))
        for s, x in zip(sets, sums):
            s.learn(inputs, x, bit)
        for c in cells:
            learn(c, bit, self.limit)
        return bit

    def choose(self, family, main):
        return self.decide(family, (main, 0, None))

    def classed(self, family, context, start):
        """A magnitude and its class."""

        def above(c):
            return self.decide(family, context, c, c + 35 - start)

        c = start
        if above(c):
            c += 1
            while c < 35 and above(c):
                c += 1
        else:
            while c > 0 and not above(c - 1):
                c -= 1
        if c < 2:
            return c, c
        first = self.decide(family, context, 44 + c, 80 + c + 35 - start)
        x, rest = 2 | first, c - 2
        if rest:
            x = x << 1 | self.decide(family, context, 80 + 2 * c + first, 160 + first)
            rest -= 1
        return x << rest | self.bits.plain(rest), c

    def magnitude(self, family, main, start):
        return self.classed(family, (main, 0, None), start)[0]

    def number(self, family, context, start, hint=0):
        x, c = self.classed(family, context, start)
        if x:
            kin = 72 + min(6, max(0, c + 3 - start))
            if self.decide(family, context, 36 + hint, kin, sign=kin):
                return -x
        return x

    def plain_number(self, family, main, start):
        return self.number(family, (main, 0, None), start)
