"""Do verdicts hang on the settings that were chosen by hand? All of them moved at once, at random, and the worlds asked again.

`python -m tests.hidden_effects.sensitivity` draws a factor for every setting whose reason says "chosen by hand", log-uniform
between 1/F and F, and asks a spread of the generated worlds under each draw: one joint study instead of one for each setting.
A verdict that changes is asked again with only one room's settings moved, which says where it hangs.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from bns.diagnose.settings import DEFAULTS
from bns.diagnose.settings.setting import BY_HAND
from tests.hidden_effects.answer import Answer, read
from tests.hidden_effects.asking import answers, shares
from tests.hidden_effects.judge import RIGHT, judge, said
from tests.hidden_effects.plan import select, worlds
from tests.hidden_effects.world import World

Moved = dict[str, dict[str, Any]]


def moved(factor: float, draw: int) -> Moved:
    """Room -> name -> value: every number chosen by hand times a factor of its own between 1/`factor` and `factor`."""
    random = np.random.default_rng([draw, 2026])
    out: Moved = {}
    for room, name, value, unit, why in DEFAULTS.rows():
        if not why.endswith((BY_HAND, f"{BY_HAND}.")) or isinstance(value, bool | str):
            continue
        times = float(np.exp(random.uniform(-1, 1) * np.log(factor)))
        out.setdefault(room, {})[name] = scaled(value, times, ceiling=0.99 if unit == "1" else np.inf)
    return out


def scaled(value: Any, times: float, ceiling: float = np.inf) -> Any:
    """A number, or numbers, times a factor; whole ones stay whole and at least 1; shares and chances below 1 stay below it."""
    if isinstance(value, tuple | list):
        return [scaled(one, times, ceiling) for one in value]
    if isinstance(value, str):
        return value
    if isinstance(value, int):
        return max(round(value * times), 1)
    return float(min(value * times, ceiling) if value < 1 else value * times)


def same(one: Answer, other: Answer) -> bool:
    """The same verdict on the same explanations."""
    return (one.verdict, one.explanations) == (other.verdict, other.explanations)


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.hidden_effects.sensitivity", description=__doc__)
    parser.add_argument("--factor", type=float, default=1.5, help="no setting is moved by more (1.5)")
    parser.add_argument("--draws", type=int, default=8, help="joint draws of all settings (8)")
    parser.add_argument("--worlds", type=int, default=14, help="worlds asked under each, evenly spread over the families (14)")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--results", type=Path, default=Path("results/sensitivity"))
    options = parser.parse_args(arguments)
    os.environ.update(shares(options.jobs))
    chosen = select(worlds(0), "", quick=True)
    asked = [chosen[int((i + 0.5) * len(chosen) / options.worlds)] for i in range(options.worlds)]
    usual = _ask(asked, options.results / "default", options.jobs, {})
    told: dict[str, Any] = {"factor": options.factor, "worlds": {w.name: judge(w, usual[w.name]) for w in asked}, "draws": []}
    for draw in range(options.draws):
        settings = moved(options.factor, draw)
        found = _ask(asked, options.results / f"draw-{draw}", options.jobs, settings)
        other = [w for w in asked if not same(found[w.name], usual[w.name])]
        told["draws"].append(
            {
                "settings": settings,
                "right": sum(judge(w, found[w.name]) == RIGHT for w in asked),
                "changed": {w.name: {"said": said(w, found[w.name]), "judged": judge(w, found[w.name])} for w in other},
                "rooms": _rooms(other, usual, settings, options.results / f"draw-{draw}", options.jobs),
            }
        )
        print(f"draw {draw}: {len(asked) - len(other)} of {len(asked)} the same", *(w.name for w in other), flush=True)
    options.results.joinpath("sensitivity.json").write_text(json.dumps(told, indent=1) + "\n")
    return 0


def _rooms(other: Sequence[World], usual: Mapping[str, Answer], settings: Moved, folder: Path, jobs: int) -> dict[str, list[str]]:
    """World -> the rooms of which one alone, moved, changes its answer."""
    out: dict[str, list[str]] = {w.name: [] for w in other}
    for room in settings if other else ():
        found = _ask(other, folder / room, jobs, {room: settings[room]})
        for world in other:
            if not same(found[world.name], usual[world.name]):
                out[world.name].append(room)
    return out


def _ask(asked: Sequence[World], folder: Path, jobs: int, settings: Moved) -> dict[str, Answer]:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "settings.yaml"
    path.write_text(yaml.safe_dump(settings))
    more = ["--settings", str(path.resolve())] if settings else []
    out = {}
    for world, record in answers(asked, folder / "answers", jobs, False, more):
        if record["answer"] is None:
            print(f"{world.name}: {record['error']}", file=sys.stderr)
        out[world.name] = read(record["answer"] or {})
    return out


if __name__ == "__main__":
    sys.exit(main())
