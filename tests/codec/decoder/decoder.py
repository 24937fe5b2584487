"""A second decoder of `.cmz` files, written from `docs/format.md` alone.

    decoder.py MESH.cmz OUT_PREFIX ...    writes OUT_PREFIXV.npy, and OUT_PREFIXG.npy if any

Made to be read beside that page, section by section; it shares nothing with the program. This file
has the container and the streams behind a chunk (sections 1 and 7 to 9).
"""

import itertools
import struct
import sys

from bits import LABEL, NUMBER, REFERENCE, TURN, Coder
from walk import Chunk
from xxh3 import xxh3

HEAD = struct.Struct("<8sI4BQQ4dQ")
ENTRY = struct.Struct("<12Q6i4Q")
TAIL = struct.Struct("<QQQ8s")


class Entry:
    def __init__(self, fields, data):
        at, self.whole, self.degenerate, self.vertices, self.loose = fields[0], *fields[5:9]
        self.references, self.turned = fields[9:11]
        self.component, _, total, labels_total = fields[18:]
        self.streams = []
        for length in fields[1:5]:
            self.streams.append(data[at : at + length])
            at += length
        assert xxh3(b"".join(self.streams[:3])) == total, "the sum of a chunk"
        assert xxh3(self.streams[3]) == labels_total, "the sum of a chunk's components"


def references(data, count):
    """The place of each reference in its chunk, the chunk that owns it, its rank there."""
    coder = Coder(data, False)
    place = chunk = rank = 0
    for _ in range(count):
        place += coder.magnitude(REFERENCE, 0, 4)
        chunk += coder.plain_number(REFERENCE, 1, 0)
        rank += coder.plain_number(REFERENCE, 2, 6)
        yield place, chunk, rank
    coder.bits.end()


def step(coder, family, far, main, start):
    if coder.choose(family, far):
        high = coder.bits.plain(32)
        return high << 32 | coder.bits.plain(32)
    return coder.plain_number(family, main, start)


def kept_order(data, triangles, vertices):
    """The number and the turn of each triangle, and the numbers of the vertices."""
    coder = Coder(data, False)

    def numbers(offset):
        number = c = 0
        while True:
            x = step(coder, NUMBER, 72, offset + c, min(c, 34))
            number = number + x & (1 << 64) - 1
            c = min(35, abs(x).bit_length())
            yield number

    rows, turn = [], 0
    for _, number in zip(range(triangles), numbers(0)):
        turn = 1 + coder.choose(TURN, 2 * turn + 1) if coder.choose(TURN, 2 * turn) else 0
        rows.append((number, turn))
    names = [number for _, number in zip(range(vertices), numbers(36))]
    coder.bits.end()
    return rows, names


def components(entry):
    """The component of each triangle that names three vertices."""
    labels, label = [], entry.component
    if not entry.streams[3]:
        return [label] * entry.whole
    coder = Coder(entry.streams[3], False)
    while len(labels) < entry.whole:
        run = coder.magnitude(LABEL, 0, 8)
        label += step(coder, LABEL, 2, 1, 1)
        labels += [label] * run
    coder.bits.end()
    assert len(labels) == entry.whole
    return labels


def decode(data):
    """The head's fields, the triangles, the components, and the vertices' integer coordinates."""
    head = HEAD.unpack(data[: HEAD.size])
    assert head[:2] == (b"\x89CMZ\r\n\x1a\n", 1), "not a file of version 1"
    assert xxh3(data[: HEAD.size - 8]) == head[-1], "the sum of the head"
    at, count, total, end = TAIL.unpack(data[-TAIL.size :])
    entries = data[at : -TAIL.size]
    assert end == b"CMZ end\n" and len(entries) == count * ENTRY.size
    assert xxh3(entries) == total, "the sum of the entries"
    level, ordered = head[2], head[5]
    triangles, labels, points = [None] * head[6], [None] * head[6], [None] * head[7]
    row, first, owned = 0, 0, []
    for fields in ENTRY.iter_unpack(entries):
        entry = Entry(fields, data)
        chunk = Chunk(entry.streams[0], entry, level == 1)
        chunk.decode()
        places, others = chunk.places(), {}
        if entry.references:
            for place, owner, rank in references(entry.streams[1], entry.references):
                others[places[place]] = owned[owner][rank]
        rows, names = [(row + i, 0) for i in range(len(chunk.triangles))], dict(others)
        if ordered:
            rows, names = kept_order(entry.streams[2], len(rows), entry.vertices)
        else:
            names |= zip((v for v in places if v not in others), itertools.count(first))
        owned.append([names[v] for v in places if v not in others])
        for v, name in others.items():
            assert names[v] == name and points[name] == chunk.positions.points[v], "a reference"
        for v, point in enumerate(chunk.positions.points):
            points[names[v]] = point
        for (i, turn), triangle in zip(rows, chunk.triangles):
            a, b, c = (names[v] for v in triangle)
            triangles[i] = ((a, b, c), (c, a, b), (b, c, a))[turn]
        for (i, _), label in zip(rows, components(entry)):
            labels[i] = label
        row, first = row + len(rows), first + entry.vertices - entry.references
    assert None not in triangles and None not in points
    return head, triangles, labels, points


def f4_of(x):
    bits = (x ^ (x >> 31 & 0xFFFFFFFF) >> 1) & 0xFFFFFFFF
    return struct.unpack("<f", struct.pack("<I", bits))[0]


def write_npy(path, kind, rows):
    header = f"{{'descr': '<{kind}', 'fortran_order': False, 'shape': ({len(rows)}, 3), }}"
    header = header.ljust(4085) + "\n"
    pack = struct.Struct("<3" + {"u4": "I", "f4": "f", "f8": "d"}[kind]).pack
    with open(path, "wb") as file:
        file.write(b"\x93NUMPY\1\0" + struct.pack("<H", len(header)) + header.encode())
        file.write(b"".join(pack(*row) for row in rows))


def main(path, prefix):
    with open(path, "rb") as file:
        head, triangles, _, points = decode(file.read())
    write_npy(prefix + "V.npy", "u4", triangles)
    coordinates, size, least, grid = head[3], head[4], head[8:11], head[11]
    if coordinates == 1:
        rows = [[l + grid * x for l, x in zip(least, point)] for point in points]
        write_npy(prefix + "G.npy", f"f{size}", rows)
    elif coordinates == 2:
        write_npy(prefix + "G.npy", "f4", [[f4_of(x) for x in point] for point in points])


if __name__ == "__main__":
    for path, prefix in zip(sys.argv[1::2], sys.argv[2::2], strict=True):
        try:
            main(path, prefix)
        except Exception as error:
            raise SystemExit(f"{path}: {error!r}") from error
