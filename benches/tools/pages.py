"""What is drawn from results: charts, the index of a folder, and the README's blocks of figures.

`tests/figures.rs` holds the README's figures to the same files by a reading of its own.
"""

import os
import re

from . import chart, results

OURS = "cornermill"
SHOWN = [("sphere", "coherent", "8M coherent"), ("sphere", "shuffled", "8M shuffled")]
SIZE = (7_000_000, 9_000_000)


def rows_of(peers, order, low, high):
    """The rows on the sphere of a size, by peer."""
    found = {}
    for row in peers["rows"]:
        shuffled = order.startswith("shuffle") == row["order"].startswith("shuffle")
        plain = row["mesh"].startswith("sphere") and "defects" not in row["mesh"]
        if plain and shuffled and low <= row["triangles"] <= high:
            found[row["peer"]] = row
    return found


def ratios(row, ours):
    """Time and memory of a peer in those of Cornermill, or why there are none."""
    if row is None:
        return ("not run", "not run")
    if not row["seconds"]:
        word = {"timeout": "timed out", "memory": "out of memory", "crash": "crashed"}.get(row["outcome"], row["outcome"])
        return (word, word)
    if not ours or not ours["seconds"]:
        return ("no ratio", "no ratio")
    return tuple(row[key]["median"] / ours[key]["median"] for key in ("seconds", "peak_mib"))


def right(row):
    """How many of the answers that a peer offers are right: `4 of 5`."""
    said = [one["verdict"] for one in (row or {}).get("right", {}).values()]
    judged = [v for v in said if v in ("right", "wrong")]
    return f"{judged.count('right')} of {len(judged)}" if judged else "none"


def names(peers):
    found = list(dict.fromkeys(row["peer"] for row in peers["rows"]))
    return [name for name in found if name != OURS]


def figure(value):
    if isinstance(value, str):
        return value
    return f"{value:.1f}" if value < 100 else f"{value:.0f}"


def peers_table(peers, low=SIZE[0], high=SIZE[1]):
    """The README's table of peers, or None when the run has no rows of that size."""
    tables = [rows_of(peers, order, low, high) for _, order, _ in SHOWN]
    if not all(OURS in table for table in tables):
        return None
    head = "| tool | 8M coherent: time | memory | answers right | 8M shuffled: time | memory | answers right |\n"
    text = head + "| --- |" + " ---: |" * 6 + "\n"
    for name in names(peers):
        cells = []
        for table in tables:
            row = table.get(name)
            cells += [*map(figure, ratios(row, table[OURS])), right(row)]
        text += f"| {name} | " + " | ".join(cells) + " |\n"
    return text


def smallest(row, level):
    return row["encoders"][f"cornermill {level}, threads all"]["bytes"]


def draco_table(draco, bits=14):
    """The README's table of sizes."""
    head = "| mesh | triangles | V + G, zstd | Draco as it came | Draco oriented | `fast` | `strong` | `fast` / Draco | `strong` / Draco |\n"
    text = head + "| --- |" + " ---: |" * 8 + "\n"
    for mesh in draco["meshes"]:
        for row in (row for row in mesh["rows"] if row["bits"] == bits):
            n, best = mesh["triangles"], row["draco_best_bytes"]
            zstd = mesh["zstd_v_and_g"]
            oriented = row["draco"]["oriented"]
            came = row["draco"].get("came", oriented)
            sizes = [came["bytes"], oriented["bytes"], smallest(row, "fast"), smallest(row, "strong")]
            cells = [f"{n:,}".replace(",", " "), f"{min(z['bits_a_triangle'] for z in zstd.values()):.1f}"]
            cells += [f"{8 * size / n:.2f}" for size in sizes]
            cells += [f"{smallest(row, level) / best:.2f}" for level in ("fast", "strong")]
            label = mesh["name"] + ": " + mesh["words"] + (" (real)" if mesh["real"] else "")
            text += f"| {label} | " + " | ".join(cells) + " |\n"
    return text


def draco_chart(draco, bits=14):
    rows = []
    for mesh in draco["meshes"]:
        for row in (row for row in mesh["rows"] if row["bits"] == bits):
            values = [smallest(row, level) / row["draco_best_bytes"] for level in ("fast", "strong")]
            rows.append((f"{mesh['name']}{' (real)' if mesh['real'] else ''}", values))
    note = f"positions at {bits} bits; 1 is Draco's smallest of all levels, triangles as they came or oriented; less is smaller"
    return chart.bars("Sizes relative to Draco", note, ["cornermill fast", "cornermill strong"], rows) if rows else None


def peers_charts(peers):
    """A chart for each order at the largest size that every run has: 8M, else 1M."""
    for order in ("coherent", "shuffled"):
        for low, high, size in ((*SIZE, "8M"), (900_000, 1_100_000, "1M")):
            table = rows_of(peers, order, low, high)
            if OURS in table and len(table) > 1:
                rows = [(name, ratios(table.get(name), table[OURS])) for name in names(peers)]
                note = f"sphere of {size} triangles, {order}; 1 is Cornermill; peers in memory without loading, Cornermill's whole process"
                yield f"peers-{order}.svg", chart.bars("Time and memory relative to Cornermill", note, ["time", "memory"], rows, log=True)
                break


def draw(folder):
    """Writes the charts of a folder's parts, and returns their names."""
    drawn = []
    draco, peers = (results.load(os.path.join(folder, part)) for part in ("draco.json", "peers.json"))
    charts = list(peers_charts(peers)) if peers else []
    if draco and (svg := draco_chart(draco)):
        charts.append(("draco.svg", svg))
    for name, svg in charts:
        results.save(os.path.join(folder, name), svg)
        drawn.append(name)
    return drawn


def index(folder, run):
    """The folder's README.md: what ran, where it is told, and the charts."""
    drawn = draw(folder)
    text = f"# Results of {run['date']}: {run['cpu']}, {run['cores']} cores\n\nCommit {run['commit']}, made by `benches/run"
    text += " --quick`" if run["quick"] else "`"
    text += ".\n\n| part | what it is | seconds | |\n| --- | --- | ---: | --- |\n"
    for part in run["parts"]:
        page = f"[{part['page']}]({part['page']})" if os.path.exists(os.path.join(folder, part["page"])) else "no page"
        text += f"| {page} | {part['words']} | {part['seconds']:.0f} | {part['outcome']} |\n"
    text += "\n" + "".join(f"![{name}]({name})\n\n" for name in drawn)
    results.save(os.path.join(folder, "README.md"), text.rstrip() + "\n")


def block(name, folder, body):
    place = os.path.relpath(folder, results.machine.ROOT)
    page = f"{place}/{name}.md"
    return f"<!-- figures: {name} -->\n{body}\n[All rows]({page})\n<!-- figures end -->"


def readme():
    """Rewrites the marked blocks of README.md from the newest results that have them."""
    path = os.path.join(results.machine.ROOT, "README.md")
    with open(path) as file:
        text = file.read()
    for name, table in (("peers", peers_table), ("draco", draco_table)):
        folder = results.newest(f"{name}.json")
        body = table(results.load(os.path.join(folder, f"{name}.json"))) if folder else None
        if body is None:
            print(f"README.md: no results for {name}: its block stays")
            continue
        pattern = rf"<!-- figures: {name} -->.*?<!-- figures end -->"
        text, hits = re.subn(pattern, lambda _: block(name, folder, body), text, flags=re.S)
        print(f"README.md: {name} from {os.path.basename(folder)}" if hits else f"README.md has no block for {name}")
    results.save(path, text)
