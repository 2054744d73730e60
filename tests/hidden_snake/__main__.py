"""Write hidden snakes, ask `bns diagnose --model snake --json` about each, and print what was said."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from tests.hidden_snake.worlds import World, worlds, write


def main(arguments: list[str] | None = None) -> int:
    """Command line; what was answered before is not asked again."""
    parser = argparse.ArgumentParser(prog="python -m tests.hidden_snake", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", default=[], metavar="NAME")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--trials", type=int, default=60)
    parser.add_argument("--cycles", type=int, default=10)
    options = parser.parse_args(arguments)
    options.folder.mkdir(parents=True, exist_ok=True)
    chosen = [world for world in worlds() if not options.only or world.name in options.only]
    for world in chosen:
        answer = options.folder / f"{world.name}.json"
        if not answer.exists():
            _ask(world, options, answer)
        print(row(world, json.loads(answer.read_text())), flush=True)
    return 0


def _ask(world: World, options: argparse.Namespace, answer: Path) -> None:
    table = write(world, options.folder, options.seed, options.trials, options.cycles)
    began = time.monotonic()
    command = [sys.executable, "-m", "bns", "diagnose", str(table), "--model", "snake", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    said = json.loads(done.stdout.splitlines()[-1])
    answer.write_text(json.dumps({**said, "seconds_s": time.monotonic() - began}))


def row(world: World, answer: dict[str, Any]) -> str:
    """One line of the confusion matrix."""
    said = answer["verdict"] + (f": {' + '.join(answer['effects'])}" if answer["effects"] else "")
    return f"{'right' if judged(world, answer) else 'wrong':6}{world.family:9}{world.name:20}{said}"


def judged(world: World, answer: dict[str, Any]) -> bool:
    """The right effects and nothing else; a tie must hold the right set; `none` and `unlisted` by name."""
    if not world.right:
        return bool(answer["verdict"] == world.family)
    sets = [set(names) for names in answer["explanations"]]
    return answer["verdict"] in {"effects", "tie"} and set(world.right) in sets


if __name__ == "__main__":
    sys.exit(main())
