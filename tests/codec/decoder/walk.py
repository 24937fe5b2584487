"""Section 4 of `docs/format.md`: the triangles of a chunk, grown along a border."""

from bits import BACK, BORDER, FAN_LEFT, FAN_RIGHT, LEFT, LINK, NEW, REVERSED, RIGHT, SEEN, ZIP
from bits import Coder, held, log4
from place import Positions, add, dot, less, shifted


class Edge:
    """One of the border; `no_right` and `no_left` hold the ears that a fan denied it."""

    def __init__(self, slot, origin, apex, far):
        self.slot, self.origin, self.apex, self.far = slot, origin, apex, far
        self.open = self.there = True
        self.next = self.previous = self.no_right = self.no_left = None
        self.listed = 0

    def end(self):
        return self.next.origin

    def state(self):
        return self, self.origin, self.end(), self.apex


def ear(e, f):
    """What an ear over two successive edges depends on."""
    return e.state() + f.state()


def join(e, f):
    e.next, f.previous = f, e


class Chunk:
    def __init__(self, data, entry, strong):
        self.coder, self.entry = Coder(data, strong), entry
        self.positions = Positions(self.coder)
        self.triangles, self.count = [], []
        self.slots, self.free, self.behind = [], [], {}
        self.stacks, self.time = [[] for _ in range(8)], 0

    def decode(self):
        self.positions.read_lists(self.entry.vertices)
        while len(self.triangles) < self.entry.whole:
            self.seed()
            while e := self.next_gate():
                self.open_gate(e)
        for _ in range(self.entry.degenerate):
            self.triangles.append(tuple(self.three_vertices()))
        for i in range(self.entry.loose):
            self.lone(3 if i else 0)
        self.coder.bits.end()

    def places(self):
        """The vertices of the rim, as they follow each other there, then the others."""
        placed = {}
        for v in sorted(self.behind):
            while v in self.behind and v not in placed:
                placed[v] = None
                v = self.behind[v]
        return list(placed) + [v for v in range(len(self.count)) if v not in placed]

    # Vertices and triangles

    def vertex(self):
        self.count.append(0)
        return len(self.count) - 1

    def lone(self, context):
        self.positions.lone(context)
        return self.vertex()

    def back(self, main):
        return len(self.count) - 1 - self.coder.magnitude(BACK, main, 8)

    def three_vertices(self):
        vertices = []
        for i in range(3):
            seen = self.count and self.coder.choose(SEEN, 0)
            vertices.append(self.back(0) if seen else self.lone(3 if i else 0))
        return vertices

    def triangle(self, a, b, c):
        for v in a, b, c:
            self.count[v] += 1
        if self.entry.turned and self.coder.choose(REVERSED, 0):
            b, c = c, b
        self.triangles.append((a, b, c))

    # The border

    def new_edge(self, origin, apex, far):
        if self.free:
            slot = self.free.pop()
        else:
            slot = len(self.slots)
            self.slots.append(None)
        self.slots[slot] = Edge(slot, origin, apex, far)
        return self.slots[slot]

    def drop(self, e):
        e.there = False
        self.free.append(e.slot)

    def seed(self):
        v = self.three_vertices()
        self.triangle(*v)
        edges = [self.new_edge(v[(i + 1) % 3], v[i], v[i]) for i in range(3)]
        for i in range(3):
            join(edges[i - 1], edges[i])
        self.list(*edges)

    def list(self, *edges):
        """Lists gates anew, in this order."""
        for e in edges:
            if e.open and e.there:
                self.time += 1
                e.listed = self.time
                level = held((self.gap_right(e) - 8) // 2, 0, 6) if e.next.open else 7
                self.stacks[level].append((e, self.time))

    def next_gate(self):
        for stack in self.stacks:
            while stack:
                e, time = stack.pop()
                if e.there and e.open and e.listed == time:
                    return e
        return None

    def gap(self, e, q, at_end):
        points = self.positions.points
        a, b, p, q = (points[v] for v in (e.origin, e.end(), e.apex, q))
        _, (p, q, b) = shifted(29, less(p, a), less(q, a), less(b, a))
        side = less(q, b) if at_end else q
        miss = less(b, add(p, q))
        return held(log4(dot(miss, miss)) - log4(dot(b, b) + dot(side, side)) + 16, 0, 23)

    def gap_right(self, e):
        return self.gap(e, e.next.end(), True)

    def gap_left(self, e):
        return self.gap(e, e.previous.origin, False)

    def ear_context(self, g, left, pivot, other, apex, onward):
        v, w, u = (min(self.count[x], 9) for x in (pivot, other, apex))
        eight = [
            g << 8 | left << 2,
            v << 8 | w << 4 | u,
            g // 2 << 12 | v << 8 | w << 4,
            g // 3 << 12 | left // 3 << 8 | v << 4,
            g,
            v << 4 | u,
            g << 12 | left << 6 | v,
            g // 4 << 12 | v << 8 | w << 4 | u,
        ]
        return 240 * onward + 10 * g + v, g, eight

    # The gate

    def open_gate(self, e):
        decide, choose = self.coder.decide, self.coder.choose
        f, d = e.next, e.previous
        a, b, p, c, z = e.origin, f.origin, e.apex, f.end(), d.origin
        longer = f.next is not e
        right, left = longer and f.open, longer and d.open
        ask_right = right and e.no_right != ear(e, f)
        ask_left = left and e.no_left != ear(d, e)
        g, l = self.gap_right(e), self.gap_left(e)
        onward = a > c
        to_right = self.ear_context(g, l, b, a, p, onward)
        to_left = self.ear_context(l, l, a, b, p, onward)

        if ask_right and decide(RIGHT, to_right):
            self.triangle(c, b, a)
            return self.ear_right(e)
        if ask_left and decide(LEFT, to_left):
            self.triangle(z, b, a)
            return self.ear_left(e)
        sides = (g > 12 or not ask_right) + 2 * (l > 12 or not ask_left)
        if choose(BORDER, 4 * (f.open + 2 * d.open) + sides):
            e.open = False
            self.behind[a] = b
            return self.list(d)
        if not choose(NEW, min(g if ask_right else 23, l if ask_left else 23)):
            m = self.linked(e)
            self.triangle(m.origin, b, a)
            before, h = m.previous, self.tip(e, m.origin)
            join(h, f)
            join(before, h)
            join(e, m)
            return self.list(d, e, before, h)
        if choose(SEEN, 2):
            v = self.back(1)
            self.triangle(v, b, a)
            h = self.tip(e, v)
            join(h, f)
            join(e, h)
            return self.list(d, e, h)
        border = self.positions.border(e, g, l)
        v = self.vertex()
        self.triangle(v, b, a)
        h = self.tip(e, v)
        join(h, f)
        join(e, h)
        fan = 0
        if right and decide(FAN_RIGHT, to_right):
            fan = 2
            self.triangle(c, b, v)
            self.ear_right(h, False)
        elif right:
            h.no_right = ear(h, f)
        if left and decide(FAN_LEFT, to_left):
            fan += 1
            self.triangle(z, v, a)
            self.ear_left(e, False)
        elif left:
            e.no_left = ear(d, e)
        self.positions.place(border, fan)
        self.list(e.previous, h, e)

    def tip(self, e, v):
        """The gate a->b becomes a->v; gives v->b."""
        a, b, p = e.origin, e.end(), e.apex
        e.apex, e.far = b, p
        return self.new_edge(v, a, p)

    def ear_right(self, e, listed=True):
        f = e.next
        e.apex, e.far = f.origin, e.apex
        self.drop(f)
        join(e, f.next)
        self.after_ear(e, listed)

    def ear_left(self, e, listed=True):
        d = e.previous
        e.apex, e.far, e.origin = e.origin, e.apex, d.origin
        self.drop(d)
        join(d.previous, e)
        self.after_ear(e, listed)

    def after_ear(self, e, listed):
        if listed:
            self.list(e, e.previous)
        whole = e.next is e.previous
        for x, y in ((e.previous, e), (e, e.next))[: 1 if whole else 2]:
            there_and_back = x is not y and x.origin == y.end()
            if there_and_back and x.open and y.open and self.coder.choose(ZIP, int(whole)):
                self.drop(x)
                self.drop(y)
                if not whole:
                    before = x.previous
                    join(before, y.next)
                    self.list(before)
                return

    def linked(self, e):
        far = self.coder.plain_number(LINK, 0, 3)
        if far == 0:
            return self.slots[self.coder.bits.plain(len(self.slots).bit_length())]
        m = e.next if far > 0 else e
        for _ in range(abs(far)):
            m = m.next if far > 0 else m.previous
        return m
