"""Sizes, seconds and memory of one mesh at one number of bits, by Draco and by Cornermill.

Encoders take turns: in each round every one of them encodes and decodes once, so that whatever else
the machine does meets all. All are whole processes, files in the page cache: Draco reads a PLY and
writes its own format, Cornermill reads a mesh folder. Decoders write a PLY.
"""

import hashlib
import os
import re

import triangles
from tools.process import Failed, run, spread

LEVELS = range(11)


class Tools:
    """The programs."""

    def __init__(self, cornermill, data_gen, encoder="draco_encoder", decoder="draco_decoder"):
        self.cornermill, self.data_gen, self.encoder, self.decoder = cornermill, data_gen, encoder, decoder


class Prepared:
    """A mesh on disk: its folder, and as PLY both ways."""

    def __init__(self, tools, mesh, place):
        self.tools, self.name, self.place = tools, mesh.name, place
        source = mesh.make(tools.data_gen, self.path("in"))
        self.folder = self.path("ct")
        common = ["--force", "--progress", "none"]
        build = [tools.cornermill, "build", *source, "-o", self.folder, *common]
        self.built = run(build)
        self.came, self.oriented = self.path("came.ply"), self.path("oriented.ply")
        export = [tools.cornermill, "export", self.folder, "--force", "-o"]
        run([*export, self.oriented])
        run([*export, self.came, "--input-orientation"])
        self.v, self.g = triangles.folder(self.folder)
        with open(self.came, "rb") as a, open(self.oriented, "rb") as b:
            self.same = all(x == y for x, y in zip(iter(lambda: a.read(1 << 20), b""), iter(lambda: b.read(1 << 20), b"")))

    def path(self, ending):
        return os.path.join(self.place, f"{self.name}.{ending}")

    def ways(self):
        """The PLY files to encode, by how their triangles are turned."""
        return {"oriented": self.oriented} if self.same else {"came": self.came, "oriented": self.oriented}


def counts(prepared):
    """The counts of a mesh, and what its arrays take, in bits a triangle; zstd beside."""
    n, vertices = len(prepared.v), len(prepared.g)
    arrays = {}
    for name in ("V", "O", "G", "component"):
        size = os.path.getsize(os.path.join(prepared.folder, name + ".npy"))
        arrays[name] = 8 * size / n
    zstd = {}
    for level in (3, 19):
        if level == 19 and n > 2_000_000:
            continue
        packed, seconds, peak = 0, 0.0, 0
        for name in ("V", "G"):
            out = prepared.path("zst")
            ran = run(["zstd", f"-{level}", "-q", "-f", os.path.join(prepared.folder, name + ".npy"), "-o", out])
            packed, seconds, peak = packed + os.path.getsize(out), seconds + ran.seconds, max(peak, ran.peak)
        zstd[str(level)] = {"bytes": packed, "bits_a_triangle": 8 * packed / n, "seconds": seconds, "peak_bytes": peak}
    return {"triangles": n, "vertices": vertices, "array_bits_a_triangle": arrays, "zstd_v_and_g": zstd}


def draco_encode(prepared, source, bits, level, out):
    return run([prepared.tools.encoder, "-i", source, "-o", out, "-qp", bits, "-cl", level])


def sweep(prepared, bits):
    """Draco's size at every level for every way, and the smallest."""
    found = {}
    for way, source in prepared.ways().items():
        out = prepared.path("drc")
        sizes = []
        for level in LEVELS:
            draco_encode(prepared, source, bits, level, out)
            sizes.append(os.path.getsize(out))
        best = min(LEVELS, key=lambda level: (sizes[level], level))
        draco_encode(prepared, source, 1, best, out)
        found[way] = {"bytes_by_level": sizes, "level": best, "bytes": sizes[best]}
        found[way]["bytes_at_qp_1"] = os.path.getsize(out)
    return found


def contenders(prepared, bits, draco):
    """Each encoder by name: its encoding command, its file, and its decoding command."""
    tools, found = prepared.tools, {}
    out = prepared.path("back.ply")
    for way, source in prepared.ways().items():
        for level in sorted({draco[way]["level"], 7}):
            file = prepared.path(f"{way}.{level}.drc")
            encode = [tools.encoder, "-i", source, "-o", file, "-qp", bits, "-cl", level]
            found[f"draco {way} -cl {level}"] = (encode, file, [tools.decoder, "-i", file, "-o", out])
    for level in ("fast", "strong"):
        for threads in ("1", "all"):
            file = prepared.path(f"{level}.cmz")
            more = ["--progress", "none", "--memory", "512MiB"] + (["--threads", "1"] if threads == "1" else [])
            encode = [tools.cornermill, "encode", prepared.folder, "-o", file, "--bits", bits]
            encode += ["--level", level, "--force", *more]
            decode = [tools.cornermill, "decode", file, "-o", out, "--force", *more]
            found[f"cornermill {level}, threads {threads}"] = (encode, file, decode)
    return found


def judge(prepared, bits, name, truth):
    """What the file that was just decoded holds, against what was encoded."""
    v, g = triangles.ply(prepared.path("back.ply"))
    grid = triangles.Grid(prepared.g, bits)
    rows = triangles.keys(v, grid.nodes(g))
    missing, new = triangles.differing(truth, rows)
    found = {"triangles_out": len(v), "vertices_out": len(g), "missing": missing, "new": new}
    if not name.startswith("draco came"):
        thick = triangles.differing(truth[~triangles.flat(truth)], rows[~triangles.flat(rows)])
        found["missing_with_area"], found["new_with_area"] = thick
    return found


def rounds(prepared, bits, draco, number):
    """Encodes and decodes by turns, and judges what each gave back the first time."""
    runs, judged = {}, {}
    # Draco's grid is over all vertices, in floats; ours over all in doubles.
    truth = triangles.keys(prepared.v, triangles.Grid(prepared.g, bits).nodes(prepared.g))
    all_of_them = contenders(prepared, bits, draco)
    for turn in range(number):
        for name, (encode, file, decode) in all_of_them.items():
            one = runs.setdefault(name, {"encode": [], "decode": [], "bytes": 0})
            one["encode"].append(run(encode))
            one["bytes"] = os.path.getsize(file)
            one["decode"].append(run(decode))
            if turn == 0:
                # The same bytes on another number of threads need no second look.
                with open(file, "rb") as coded:
                    digest = hashlib.sha256(coded.read()).hexdigest()
                if digest not in judged:
                    judged[digest] = judge(prepared, bits, name, truth)
                one["judged"] = judged[digest]
    return {name: summary(name, one) for name, one in runs.items()}


def summary(name, one):
    found = {"bytes": one["bytes"], **one["judged"]}
    for what in ("encode", "decode"):
        found[f"{what}_seconds"] = spread([ran.seconds for ran in one[what]])
        found[f"{what}_peak_bytes"] = max(ran.peak for ran in one[what])
        own = [re.search(r"\((\d+) ms to", ran.said) for ran in one[what]]
        if all(own):
            found[f"{what}_seconds_own_word"] = spread([int(m[1]) / 1000 for m in own])
    split = re.search(r"connectivity (\d+) bytes, positions (\d+) bytes", one["encode"][0].said)
    if split:
        found["connectivity_bytes"], found["position_bytes"] = int(split[1]), int(split[2])
    return found


def verdict(encoders):
    """Errors in what came back: Cornermill must give back every triangle, Draco those with area."""
    wrong = []
    for name, one in encoders.items():
        if name.startswith("cornermill") and (one["missing"] or one["new"]):
            wrong.append(f"{name}: {one['missing']} triangles missing, {one['new']} new")
    return wrong


def row(prepared, bits, number):
    """All of a mesh at one number of bits."""
    draco = sweep(prepared, bits)
    encoders = rounds(prepared, bits, draco, number)
    wrong = verdict(encoders)
    if wrong:
        raise Failed(f"{prepared.name} at {bits} bits: " + "; ".join(wrong))
    best = min(way["bytes"] for way in draco.values())
    return {"bits": bits, "draco": draco, "draco_best_bytes": best, "encoders": encoders}
