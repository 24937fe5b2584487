"""Says which peers are installed in a folder, and in what versions: prints it and writes installed.json."""

import json
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from peers import PEERS  # noqa: E402


def debian(package):
    """The version of a Debian package, or None."""
    ran = subprocess.run(["dpkg-query", "-W", "-f=${Version}", package], capture_output=True, text=True)
    return ran.stdout.strip() or None if ran.returncode == 0 else None


def python(folder, packages, module):
    """The versions of PyPI packages whose module can be loaded, or why it cannot."""
    code = (
        f"import importlib.metadata as m; import {module}; "
        f"print(', '.join(p + ' ' + m.version(p) for p in {list(packages)!r}))"
    )
    ran = subprocess.run([folder / "bin/python3", "-c", code], capture_output=True, text=True)
    if ran.returncode == 0:
        return ran.stdout.strip().splitlines()[-1], None
    return None, (ran.stderr.strip().splitlines() or ["no word"])[-1]


def look(folder):
    """For each peer its version, or why it is not there."""
    found = {}
    for peer in PEERS:
        if peer.module:
            version, why = python(folder, peer.packages, peer.module)
        else:
            version = debian(peer.packages[0])
            version = version and f"{peer.packages[0]} {version}"
            why = None if version else f"{peer.packages[0]} is not installed"
            if version and not (folder / "bin" / f"peer-{peer.name}").exists():
                version, why = None, f"not compiled: see g++-{peer.name}.log"
        found[peer.name] = {"version": version, "missing": why}
    return found


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    found = look(folder)
    (folder / "installed.json").write_text(json.dumps(found, indent=2) + "\n")
    for name, state in found.items():
        print(f"{name:15} {state['version'] or 'missing: ' + state['missing']}")
