"""draco.json as a page of tables."""

import statistics

GRID = ("fast", "strong")


def line(cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |\n"


def table(head, rows, left=1):
    return line(head) + line(["---"] * left + ["---:"] * (len(head) - left)) + "".join(map(line, rows)) + "\n"


def spaced(number):
    return f"{number:,}".replace(",", " ")


def mib(size):
    return f"{size / 2**20:.0f}"


def time(spread):
    if spread["min"] == spread["max"]:
        return f"{spread['median']:.2f}"
    return f"{spread['median']:.2f} ({spread['min']:.2f} to {spread['max']:.2f})"


def every(found):
    return [(mesh, row) for mesh in found["meshes"] for row in mesh["rows"]]


def smallest(row, level):
    """Bytes of Cornermill at a level; the same for any number of threads."""
    return row["encoders"][f"cornermill {level}, threads all"]["bytes"]


def way(row, name):
    """Draco's finding for a way; a mesh that agrees as it came has only one."""
    return row["draco"].get(name, row["draco"]["oriented"])


def sizes(found):
    head = ["mesh", "bits", "Draco as it came", "-cl", "Draco oriented", "-cl", "of it at most connectivity"]
    head += ["Cornermill fast", "strong", "of it connectivity", "fast / Draco", "strong / Draco", "Draco, bits a vertex"]
    rows = []
    for mesh, row in every(found):
        n = mesh["triangles"]
        bits = lambda size: f"{8 * size / n:.2f}"
        came, oriented = way(row, "came"), way(row, "oriented")
        strong = row["encoders"]["cornermill strong, threads all"]
        cells = [mesh["name"], row["bits"], bits(came["bytes"]), came["level"], bits(oriented["bytes"]), oriented["level"]]
        cells += [bits(oriented["bytes_at_qp_1"]), *(bits(smallest(row, level)) for level in GRID)]
        cells += [bits(strong["connectivity_bytes"]) if "connectivity_bytes" in strong else "unknown"]
        cells += [f"{smallest(row, level) / row['draco_best_bytes']:.3f}" for level in GRID]
        rows.append([*cells, f"{8 * row['draco_best_bytes'] / mesh['vertices']:.2f}"])
    return table(head, rows)


def today(found):
    head = ["mesh", "what", "triangles", "vertices", "V", "O", "G", "component", "V + G, zstd -3", "V + G, zstd -19"]
    rows = []
    for mesh in found["meshes"]:
        arrays = [f"{mesh['array_bits_a_triangle'][name]:.1f}" for name in ("V", "O", "G", "component")]
        zstd = [mesh["zstd_v_and_g"].get(level) for level in ("3", "19")]
        zstd = [f"{z['bits_a_triangle']:.1f}" if z else "not tried" for z in zstd]
        what = mesh["words"] + (" (real)" if mesh["real"] else "")
        rows.append([mesh["name"], what, spaced(mesh["triangles"]), spaced(mesh["vertices"]), *arrays, *zstd])
    return table(head, rows, 2)


def back(found):
    head = ["mesh", "bits", "encoder", "vertices out / in", "triangles out - in", "triangles with area that differ"]
    rows = []
    for mesh, row in every(found):
        for name, one in row["encoders"].items():
            if name.endswith("threads 1"):
                continue
            differ = "new vertices" if "new_with_area" not in one else one["missing_with_area"] + one["new_with_area"]
            if name.startswith("draco came"):
                differ = "turned: not compared"
            out = one["vertices_out"] / mesh["vertices"]
            rows.append([mesh["name"], row["bits"], name, f"{out:.3f}", one["triangles_out"] - mesh["triangles"], differ])
    return table(head, rows)


def cost(found):
    head = ["mesh", "bits", "encoder", "bytes", "encode s", "MiB", "decode s", "MiB", "Draco's own word: encode s", "decode s"]
    rows = []
    for mesh, row in every(found):
        for name, one in row["encoders"].items():
            cells = [mesh["name"], row["bits"], name, spaced(one["bytes"])]
            for what in ("encode", "decode"):
                cells += [time(one[f"{what}_seconds"]), mib(one[f"{what}_peak_bytes"])]
            own = (one.get(f"{what}_seconds_own_word") for what in ("encode", "decode"))
            rows.append(cells + [time(o) if o else "" for o in own])
    return table(head, rows)


def means(found):
    """Geometric means of the ratios to Draco's smallest, for each number of bits apart."""
    head = ["bits", "meshes", "`fast` / Draco", "least", "most", "`strong` / Draco", "least", "most"]
    rows = []
    for bits in sorted({row["bits"] for _, row in every(found)}):
        cells = []
        some = [row for _, row in every(found) if row["bits"] == bits]
        for level in GRID:
            ratios = [smallest(row, level) / row["draco_best_bytes"] for row in some]
            cells += [f"{value:.3f}" for value in (statistics.geometric_mean(ratios), min(ratios), max(ratios))]
        rows.append([bits, len(some), *cells])
    return "In geometric mean over the meshes:\n\n" + table(head, rows)


def markdown(found):
    if not any(mesh["rows"] for mesh in found["meshes"]):
        return "# Sizes against Draco\n\nNo rows.\n"
    v = found["versions"]
    rounds = " or ".join(sorted({str(row["rounds"]) for _, row in every(found)}))
    note = found.get("note", "")
    return (
        f"# Sizes against Draco: {found['cpu']}, {found['cores']} cores\n\n"
        f"{found['date']}, commit {found['commit']}; Debian's draco {v['draco']} and zstd {v['zstd']}. Made by `benches/draco/run`.\n\n"
        "## Bits a triangle\n\n"
        "Positions only. Draco's size is the smallest over `-cl` 0 to 10, and which level that was, for the mesh as it came and as "
        "Cornermill oriented it; ratios are to the smaller of the two. Its connectivity is the file's size with `-qp 1`, an upper "
        "bound. Cornermill's is what `encode` reports, at `strong`. Draco welds equal positions as it reads.\n\n"
        + means(found)
        + sizes(found)
        + "## What people have today\n\nThe folder's own arrays, and V and G by zstd, in bits a triangle.\n\n"
        + today(found)
        + "## What came back\n\nEach file was decoded, and its triangles compared with those encoded as a multiset of oriented "
        "triples of grid nodes, in NumPy. Cornermill's are all equal, or the run fails. Draco works out nodes in floats, and drops triangles "
        "that fall flat on its grid and may round another way, which is what differs.\n\n"
        + back(found)
        + f"## Seconds and memory\n\n{note}Whole processes by turns, rounds: {rounds}; median (least to most); memory is the peak that the kernel saw. Draco reads "
        "and writes PLY on one thread. Cornermill reads its folder to encode, and to decode builds a folder that it exports as PLY, within 512 MiB.\n\n"
        + cost(found)
    )
