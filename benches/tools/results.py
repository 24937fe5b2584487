"""Folders of results: `benches/results/DATE-MACHINE`, one for each commit that was measured.

A second commit on one day has `-2` behind the name, a third `-3`: no part of a run overwrites what
another commit found. A folder with a word behind the name is a partial result, and never the newest.
"""

import json
import os
import re

from . import machine

RESULTS = os.path.join(machine.ROOT, "benches", "results")
PARTS = ("build.json", "draco.json", "peers.json", "run.json", "criterion.json")
NAME = re.compile(r"^(\d{4}-\d\d-\d\d)-(.*-cores)(?:-(\d+))?$")


def load(path):
    """A JSON file, or None where there is none."""
    try:
        with open(path) as file:
            return json.load(file)
    except FileNotFoundError:
        return None


def save(path, text):
    """Writes a file so that a run that is cut short leaves the old one or the new one."""
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path + ".tmp", "w") as file:
        file.write(text)
    os.replace(path + ".tmp", path)


def save_json(path, value):
    save(path, json.dumps(value, indent=1, sort_keys=True) + "\n")


def bare(commit):
    """A commit without `-dirty`: saved results themselves make the tree differ."""
    return (commit or "").removesuffix("-dirty")


def commits(folder):
    """The commits that the parts in a folder were measured at."""
    found = (load(os.path.join(folder, part)) for part in PARTS)
    return {bare(part.get("commit")) for part in found if part and part.get("commit")}


def own(quick=False):
    """The folder for this day, machine and commit: the one that has it, or a new name."""
    base = os.path.join(RESULTS, f"{machine.date()}-{machine.slug()}")
    base = os.path.join(machine.ROOT, "target", "quick") if quick else base
    number, here = 1, bare(machine.commit())
    while True:
        folder = base if number == 1 else f"{base}-{number}"
        if not commits(folder) - {here}:
            return folder
        number += 1


def newest(part):
    """The newest folder that has a part, or None: the last date, then the last number."""
    found = []
    for name in os.listdir(RESULTS) if os.path.isdir(RESULTS) else []:
        match = NAME.match(name)
        if match and os.path.exists(os.path.join(RESULTS, name, part)):
            found.append((match[1], int(match[3] or 1), name))
    return os.path.join(RESULTS, max(found)[2]) if found else None
