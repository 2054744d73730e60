"""Make the worlds, ask about each, and judge the answers."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import track

from tests.hidden_effects.acceptable import acceptable
from tests.hidden_effects.plan import worlds
from tests.hidden_effects.world import write


def main(arguments: list[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.hidden_effects", description=__doc__)
    parser.add_argument("--only", metavar="WORD", default="", help="worlds whose name holds this")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--write", type=Path, metavar="DIR", help="write the worlds there, and ask nothing")
    options = parser.parse_args(arguments)
    chosen = [world for world in worlds(options.seed) if options.only in world.name]
    for world in track(chosen, "worlds", console=Console(stderr=True), disable=not sys.stderr.isatty()):
        write(world, options.write, acceptable(world))
    return 0


if __name__ == "__main__":
    sys.exit(main())
