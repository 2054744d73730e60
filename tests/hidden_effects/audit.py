"""Are the worlds fair? For each, the explanation that comes nearest to the truth, and how near.

`python -m tests.hidden_effects.audit [WORD]`: no product is asked. A world whose nearest rival is closer than DECIDABLE has to be
changed, or the rival has to be acceptable; a listed explanation that reaches an unlisted world makes it a listed one.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path

from tests.hidden_effects.evidence import GUESSES, Evidence, Values
from tests.hidden_effects.plan import select, worlds
from tests.hidden_effects.world import World

DECIDABLE = 30.0
"""Chi-square from which on the truth can be told from a rival by anyone: five and a half standard errors."""
STEPS, FINALISTS = 3, 2


def main(arguments: list[str] | None = None) -> int:
    """One line a world, as JSON, appended to a file as they are found; worlds that are there are left out."""
    parser = argparse.ArgumentParser(prog="python -m tests.hidden_effects.audit", description=__doc__)
    parser.add_argument("word", nargs="?", default="")
    parser.add_argument("--out", type=Path, default=Path("results/hidden-effects/audit.jsonl"))
    options = parser.parse_args(arguments)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    known = {json.loads(line)["world"] for line in options.out.read_text().splitlines()} if options.out.exists() else set()
    for world in select(worlds(0), options.word, False):
        if world.name in known:
            continue
        row = {"world": world.name, "nearest": audited(world)}
        with options.out.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print(row, flush=True)
    return 0


def audited(world: World) -> list[tuple[float, list[str]]]:
    """(chi-square, names) of the rivals, the nearest first."""
    evidence = Evidence(world)
    if world.unlisted:
        return list(_climb(evidence))
    found = [(evidence.distance(names)[0], sorted(names)) for names in rivals(sorted(world.hidden))]
    return sorted(found)[:5]


def rivals(hidden: list[str]) -> Iterator[list[str]]:
    """Sets with one effect fewer, or with one exchanged for another."""
    for name in hidden:
        rest = [other for other in hidden if other != name]
        yield rest
        yield from ([*rest, other] for other in GUESSES if other not in hidden)


def _climb(evidence: Evidence) -> Iterator[tuple[float, list[str]]]:
    """What listed effects make of an unlisted one: the best added each time, of those that look best before refitting."""
    names: list[str] = []
    yield evidence.distance([])[0], []
    values: Values = {}
    for _ in range(STEPS):
        others = [name for name in GUESSES if name not in names]
        likely = sorted((evidence.distance([name], values)[0], name) for name in others)[:FINALISTS]
        distance, values = min((evidence.distance([*names, name]) for _, name in likely), key=lambda found: found[0])
        names = list(values)
        yield distance, names


if __name__ == "__main__":
    sys.exit(main())
