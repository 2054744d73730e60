"""Robots with contact physics: write their logs, diagnose each through the command line, and list what was said of it.

``python -m tests.contact_worlds DIR [--only WORD] [--seed N] [--write]``; answers that are there already are kept.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.contact_worlds.catalogue import World, worlds, write


def asked(world: World, directory: Path) -> dict[str, Any]:
    """What ``bns diagnose`` says of a log in the directory; kept as NAME.json."""
    path = directory / f"{world.name}.json"
    if not path.exists():
        log, model = (str(path.with_suffix(end)) for end in (".csv", ".yaml"))
        command = [sys.executable, "-m", "bns", "diagnose", log, "--model", model, "--json"]
        path.write_text(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    answer: dict[str, Any] = json.loads(path.read_text())
    return answer


def line(world: World, answer: dict[str, Any]) -> str:
    """What was hidden, what was said, and the held-out errors of whole trials and one second, mm."""
    errors = [answer["error"][horizon] for horizon in ("1s", "trial") if horizon in answer["error"]]
    falls = "  ".join(f"{1e3 * e['before']:.1f} -> {1e3 * e['after']:.1f} (noise {1e3 * e['noise_floor']:.1f})" for e in errors)
    said = ", ".join(answer["effects"]) or "-"
    return f"{world.name:20} {', '.join(world.expected):44} {answer['verdict']:9} {said:50} {falls}"


def main() -> None:
    """Write the logs that were asked for, and ask about each; a line for each."""
    parser = argparse.ArgumentParser(prog="python -m tests.contact_worlds", description=__doc__)
    parser.add_argument("directory", type=Path)
    parser.add_argument("--only", default="", help="worlds with this word in their name or kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--write", action="store_true", help="only write the logs")
    options = parser.parse_args()
    for world in worlds(options.seed):
        if options.only in world.name or options.only == world.kind:
            if not (options.directory / f"{world.name}.csv").exists():
                write(world, options.directory)
            print(world.name if options.write else line(world, asked(world, options.directory)), flush=True)


if __name__ == "__main__":
    main()
