"""From the journal to rows, and from rows to peers.md."""

from statistics import median

from judge import ANSWERS

OURS = "cornermill"
MARK = {"right": "✓", "wrong": "✗", "not offered": "–", "not reached": "", "not judged": "?"}
# Below this the kernel's peak may be that of the runner, whose copy the child was before it began (MiB).
SMALL = 40
WORD = {"crash": "crashed", "timeout": "timed out", "memory": "out of memory"}


def phases(run):
    """Seconds of each phase that a run came to the end of."""
    return {line["phase"]: line["seconds"] for line in run["lines"] if "phase" in line}


def total(run, ours):
    """Seconds without loading; of Cornermill the whole process, reading and writing included."""
    if ours:
        return run["wall"]
    return sum(seconds for name, seconds in phases(run).items() if name != "load")


def spread(values):
    return {"median": median(values), "min": min(values), "max": max(values)}


def row(case, peer, runs):
    """What the runs of one peer on one mesh say together."""
    ours = peer == OURS
    good = [r for r in runs if r["outcome"] == "ok"]
    bad = next((r for r in runs if r["outcome"] != "ok"), None)
    lines = [line for r in runs[:1] for line in r["lines"]]
    notes = [line["note"] for line in lines if "note" in line]
    notes += [f"{line['refused']} refused: {line['message']}" for line in lines if "refused" in line]
    notes += [f"{line['value']} triangles refused" for line in lines if line.get("answer") == "refused_triangles" and line["value"]]
    if bad:
        done = ", ".join(phases(bad)) or "nothing"
        until = f" (done until then: {done})" if bad["wall"] else ""
        notes.append(f"{WORD[bad['outcome']]}: {bad['message']}{until}")
    for run in good:
        own = next((line["hwm_kib"] / 1024 for line in run["lines"] if "hwm_kib" in line), None)
        if own and run["peak_mib"] < SMALL:
            run["peak_mib"] = own
        elif own and abs(own - run["peak_mib"]) > 0.05 * run["peak_mib"]:
            notes.append(f"the kernel's peak was {run['peak_mib']:.0f} MiB; until the end of the work {own:.0f}")
            run["peak_mib"] = own
    names = dict.fromkeys(name for r in good for name in phases(r))
    return {
        "mesh": case["name"],
        "order": case["order"],
        "triangles": case["triangles"],
        "peer": peer,
        "outcome": bad["outcome"] if bad else "ok",
        "runs": runs,
        "median_seconds": {n: median([phases(r)[n] for r in good if n in phases(r)]) for n in names},
        "seconds": spread([total(r, ours) for r in good]) if good else None,
        "wall": spread([r["wall"] for r in good]) if good else None,
        "peak_mib": spread([r["peak_mib"] for r in good]) if good else None,
        "right": runs[0].get("verdicts", {}),
        "note": "; ".join(dict.fromkeys(notes)),
    }


def mark(row, answer):
    """A verdict in a cell: a mark, and where wrong the number that was found."""
    said = row["right"].get(answer)
    if said is None:
        return "" if row["outcome"] != "ok" else "–"
    text = MARK.get(said["verdict"], said["verdict"])
    if said["verdict"] == "wrong":
        found = said["found"]
        text += f" {found:,}" if isinstance(found, int) else f" {found}"
        if "expected" in said:
            text += f" (is {said['expected']:,})"
    return text


def ratio(value, ours):
    if value is None or ours is None:
        return ""
    times = value["median"] / ours["median"]
    return f"{times:.3g}×" if times < 100 else f"{times:.0f}×"


def table(rows, titles):
    """The table of one mesh, Cornermill first."""
    ours = next((r for r in rows if r["peer"] == OURS and r["seconds"]), None)
    head = ["tool", "seconds (min–max)", "× time", "peak MiB", "× memory", *ANSWERS, "remarks"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for r in rows:
        seconds = r["seconds"]
        cells = [titles.get(r["peer"], r["peer"])]
        if seconds:
            cells += [f"{seconds['median']:.3g} ({seconds['min']:.3g}–{seconds['max']:.3g})"]
            cells += [ratio(seconds, ours and ours["seconds"]), f"{r['peak_mib']['median']:.0f}", ratio(r["peak_mib"], ours and ours["peak_mib"])]
        else:
            peak = max((run["peak_mib"] for run in r["runs"]), default=0)
            cells += [WORD.get(r["outcome"], r["outcome"]), "", f"≥ {peak:.0f}" if peak else "", ""]
        cells += [mark(r, answer) for answer in ANSWERS] + [r["note"]]
        lines.append("| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |")
    return "\n".join(lines)


def markdown(result, titles):
    """peers.md."""
    machine, floor = result["machine"], result["floor"]
    text = [
        "# Side by side",
        "",
        f"{result['date']}, {machine['cpu']}, {machine['cores']} cores, {machine['memory_gib']:.0f} GiB, {machine['system']}. "
        f"Rounds: {result['rounds']}, the tools by turns; the median, and in brackets the least and the most. "
        f"Time-out {result['timeout']:g} s, memory limit {result['memory_limit_gib']:.1f} GiB.",
        "",
        f"**What is compared.** Cornermill: its whole process, `build` with all measures at a budget of {result['budget']}, "
        "reading the arrays from disk and writing and syncing the folder. The others: the sum of their phases in memory, "
        "*without* loading and without writing anything, which favours them. Each does as much of the job as it offers, with "
        "the threads that it takes by itself; memory is the peak of the process. *× time* and *× memory* are its figures over "
        "Cornermill's. A time beside fewer answers is for less work. On meshes of a few thousand triangles Cornermill's time is "
        "that of starting a process and of syncing files.",
        "",
        "✓ right, ✗ wrong (what it found, and what is), – not offered, blank not reached. *Components* are held to the count across regular edges "
        "or across all edges, whichever the tool documents; *border* to edges with one triangle or to corners without an opposite.",
        "",
    ]
    if floor:
        text += [
            f"The machine's floor in the same run: memory copy {floor['copy_one_thread_mb_s'] / 1e3:.1f} GB/s by one thread, "
            f"{floor['copy_two_threads_mb_s'] / 1e3:.1f} by two; a file of {floor['file_mib']} MiB written and synced at "
            f"{floor['write_and_sync_mb_s'] / 1e3:.2f} GB/s, read at {floor['read_mb_s'] / 1e3:.2f}.",
            "",
        ]
    text += ["Versions: " + "; ".join(f"{titles.get(k, k)}: {v}" for k, v in result["versions"].items()) + ".", ""]
    for name, why in result["missing"].items():
        text += [f"Left out: {titles.get(name, name)}: {why}.", ""]
    meshes = dict.fromkeys((r["mesh"], r["order"], r["triangles"]) for r in result["rows"])
    for mesh, order, triangles in meshes:
        rows = [r for r in result["rows"] if (r["mesh"], r["order"]) == (mesh, order)]
        text += [f"## {mesh}, {order}: {triangles:,} triangles", "", table(rows, titles), ""]
    return "\n".join(text)
