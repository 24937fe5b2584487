"""The meshes: how each is made, what is known of it, and the real ones as plain arrays.

A mesh is V (u4) and G (f4) as .npy files and a dictionary of counts. Those of `data-gen` come with
their closed-form counts, and with V as it was before any triangle was flipped (`reference`), against
which an orientation is judged. Those of tests/meshes are read here, without Cornermill, and their counts
are those of tests/meshes/TRUTH.json, made by NumPy and SciPy.
"""

import json
import struct
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
REAL = {
    "turbine blade": "vtkdata_Apache2/turbineblade.ply",
    "foot bones": "vtkdata_Apache2/footbones.ply",
    "great white": "vtkdata_Apache2/greatWhite.stl",
    "42400-IDGH": "vtkdata_Apache2/42400-IDGH.stl",
}


@dataclass
class Case:
    """A mesh to run on; `make` lays its files. A large one is run once, if there is hope by what `smaller` took."""

    name: str
    order: str
    args: tuple = ()
    real: str = ""
    smaller: str = ""
    v: Path = None
    g: Path = None
    reference: Path = None
    truth: dict = field(default_factory=dict)

    @property
    def key(self):
        """As the journal and file names spell it."""
        return f"{self.name} {self.order}".replace(" ", "-")

    @property
    def smaller_key(self):
        """The key of the same mesh in the smaller size, or None."""
        return f"{self.smaller} {self.order}".replace(" ", "-") if self.smaller else None

    def make(self, work, data_gen, python):
        """Writes V, G and the reference, unless they are there."""
        self.v, self.g = work / f"{self.key}.npy", work / f"{self.key}.G.npy"
        truth = work / f"{self.key}.npy.json"
        if not truth.exists():
            work.mkdir(parents=True, exist_ok=True)
            if self.real:
                convert(self.real, self.v, self.g, python)
                truth.write_text(json.dumps(real_truth(self.real)))
            else:
                subprocess.run([data_gen, *self.args, "-o", self.v], check=True, stdout=subprocess.DEVNULL)
        self.truth = json.loads(truth.read_text())
        if "--flip" in self.args:
            self.reference = work / f"{self.key}.reference.npy"
            if not self.reference.exists():
                args = [a for a in self.args]
                args[args.index("--flip") + 1] = "0"
                line = [data_gen, *args, "--no-positions", "-o", self.reference]
                subprocess.run(line, check=True, stdout=subprocess.DEVNULL)
        elif not self.real:
            self.reference = self.v

    def remove(self, work):
        """Gives the disk back."""
        for path in work.glob(f"{self.key}.*"):
            path.unlink()


def cases(quick):
    """All meshes of a run, the small ones first."""
    all_cases = [Case(name, "as it came", real=path) for name, path in REAL.items()]
    orders = [("coherent", ()), ("shuffled", ("--order", "shuffle", "--flip", "0.3"))]

    def both(name, kind, size, *more, smaller=""):
        for order, args in orders:
            all_cases.append(Case(name, order, (kind, "-t", size, *more, *args), smaller=smaller))

    all_cases.append(Case("sphere 1M with defects", "coherent", ("sphere", "-t", "1M", "--diagonals", "0.5", "--defects=500")))
    both("sphere 1M", "sphere", "1M", "--diagonals", "0.5")
    both("1000 blobs 1M", "blobs", "1M", "--blobs", "1000")
    if not quick:
        both("sphere 8M", "sphere", "8M", "--diagonals", "0.5")
        both("sphere 32M", "sphere", "32M", "--diagonals", "0.5", smaller="sphere 8M")
    return all_cases


def real_truth(name):
    """Counts by a third party; `closed` and what follows from it are not known."""
    known = json.loads((ROOT / "tests/meshes/TRUTH.json").read_text())[name]
    return {**known, "components_joined": known["components"] if not known["nonmanifold_edges"] else None}


def convert(name, v, g, python):
    """Reads a real mesh in the peers' environment (it needs NumPy), by this file as a program."""
    subprocess.run([python, __file__, ROOT / "tests/meshes" / name, v, g], check=True)


def read_ply(data):
    """Triangles and positions of a PLY that has x y z as floats and faces as a list of uchar and int."""
    import numpy as np

    head, body = data[: data.index(b"end_header")].decode(), data[data.index(b"end_header") :].split(b"\n", 1)[1]
    count = {line.split()[1]: int(line.split()[2]) for line in head.splitlines() if line.startswith("element")}
    n, t = count["vertex"], count["face"]
    if "format ascii" in head:
        words = np.array(body.split(), dtype="f8")
        return words[3 * n :].reshape(t, 4)[:, 1:].astype("<u4"), words[: 3 * n].reshape(n, 3).astype("<f4")
    g = np.frombuffer(body, "<f4", 3 * n).reshape(n, 3)
    faces = np.frombuffer(body, np.dtype([("n", "u1"), ("v", "<u4", 3)]), t, 12 * n)
    assert (faces["n"] == 3).all(), "triangles alone are read here"
    return faces["v"], g


def read_stl(data):
    """A binary STL, welded by exact position (-0 is 0)."""
    import numpy as np

    (t,) = struct.unpack_from("<I", data, 80)
    record = np.dtype([("n", "<f4", 3), ("p", "<f4", (3, 3)), ("a", "<u2")])
    points = np.frombuffer(data, record, t, 84)["p"].reshape(-1, 3) + np.float32(0)
    bits, ids = np.unique(points.view("<u4"), axis=0, return_inverse=True)
    return ids.reshape(-1, 3).astype("<u4"), bits.view("<f4")


if __name__ == "__main__":
    import sys

    import numpy as np

    source = Path(sys.argv[1])
    read = read_ply if source.suffix == ".ply" else read_stl
    triangles, positions = read(source.read_bytes())
    np.save(sys.argv[2], np.ascontiguousarray(triangles))
    np.save(sys.argv[3], np.ascontiguousarray(positions))
