"""From a tie to a decision through the command line alone: diagnose, propose, drive what was proposed, diagnose all of it.

The worlds are those of `proposing`, driven so narrowly that two explanations fit, and the ties of `plan`, most of which no
commands can break. Of those `propose` must say so.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tests.hidden_effects.acceptable import explanations
from tests.hidden_effects.answer import read
from tests.hidden_effects.asking import called
from tests.hidden_effects.cause import Cause
from tests.hidden_effects.driving import ROBOTS
from tests.hidden_effects.experiment import Look, carried_out, plan_in
from tests.hidden_effects.listed import cause
from tests.hidden_effects.plan import FAR_TETHERS, ties
from tests.hidden_effects.proposing import CAMERA, CASES, JITTER, ROBOT, driven, first_look

ROOM = ("--arena", "1.6x1.2", "--start=0,0,90")


@dataclass(frozen=True)
class Open:
    """A world whose first measurements leave it open what is hidden. ``alike``: no commands can decide between these names."""

    name: str
    truth: frozenset[str]
    alike: frozenset[frozenset[str]]
    first: pd.DataFrame
    hidden: tuple[Cause, ...]
    look: Look
    model: tuple[str, ...]
    room: tuple[str, ...] = ()


def narrow(seed: int) -> Iterator[Open]:
    """Those of the benchmark of proposals."""
    for case in CASES:
        first = driven(case, first_look(case, seed), (0.0, 0.0, np.pi / 2), seed, "first")
        look = Look(ROBOT.wheelbase_m, CAMERA, case.layout, JITTER)
        truth, hidden = frozenset({case.truth}), (cause(case.truth, case.hidden),)
        name = f"{case.truth}-or-{case.rival}-{seed}"
        yield Open(name, truth, frozenset({truth}), first, hidden, look, ROBOT.arguments, ROOM)


def tied(seed: int) -> Iterator[Open]:
    """Those of the judge, which nobody can tell apart; but for far tethers, which more driving can."""
    for world in ties():
        one = type(world)(**{**vars(world), "seed": seed})
        truth = frozenset(one.hidden)
        far = one.name.removeprefix("tie-") in FAR_TETHERS
        alike = frozenset({truth}) if far else frozenset(map(frozenset, explanations(one.hidden)[0]))
        look = Look(ROBOTS[one.robot].wheelbase_m, one.camera, one.layout, one.jitter)
        yield Open(f"{one.name}-{seed}", truth, alike, one.table(), tuple(one.causes()), look, one.nominal.arguments)


def decided(one: Open, minutes: float, seed: int, folder: Path) -> dict[str, Any]:
    """What was said at first, what of the proposal, and in the end."""
    place = folder / one.name
    place.mkdir(parents=True, exist_ok=True)
    data, commands, more = (place / f"{name}.csv" for name in ("first", "next", "more"))
    one.first.to_csv(data, index=False)
    commands.unlink(missing_ok=True)
    told = _asked(
        ["propose", str(data), *one.model, *one.room, "--minutes", str(minutes), "-o", str(commands), "--json"]
    )
    before = [
        told.get("verdict", told.get("fault")),
        *sorted("+".join(sorted(names)) for names in told.get("competing_models", [])),
    ]
    pairs = told.get("model_pairs", [])
    out: dict[str, Any] = {"world": one.name, "truth": sorted(one.truth), "before": before}
    out["contests"] = [[c["first"], c["second"], c["indistinguishable"], c["power"], c["minutes"]] for c in pairs]
    if commands.is_file():
        plan, start = plan_in(commands)
        table = carried_out(plan, start, one.hidden, one.look, seed, (one.name, "more"))
        table.to_csv(more, index=False)
        out |= {
            "trials": len(plan),
            "after": _said(_asked(["diagnose", str(data), *one.model, "--more", str(more), "--json"])),
        }
    out["right"] = is_right(
        one, out.get("after", before), {frozenset({c["first"], c["second"]}) for c in pairs if c["indistinguishable"]}
    )
    return out


def _asked(arguments: list[str]) -> dict[str, Any]:
    status, out, fault = called(arguments)
    found: dict[str, Any] = json.loads(out.splitlines()[-1]) if status == 0 and out.strip() else {"fault": fault[-300:]}
    return found


def _said(answer: dict[str, Any]) -> list[str]:
    if "fault" in answer:
        return [str(answer["fault"])]
    given = read(answer)
    return [given.verdict, *sorted("+".join(sorted(names)) for names in given.explanations)]


def is_right(one: Open, said: Sequence[Any], alike: Set[frozenset[str]]) -> bool:
    """The truth alone is left; or it with what nobody can tell from it, and the proposal has said of each pair that it is so."""
    left = {frozenset(str(names).split("+")) for names in said[1:]}
    if one.truth not in left or not left <= one.alike:
        return False
    pairs = {frozenset("+".join(sorted(names)) for names in pair) for pair in combinations(left, 2)}
    told = {frozenset("+".join(sorted(title.split(" + "))) for title in pair) for pair in alike}
    return pairs <= told


def main(arguments: list[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.hidden_effects.deciding", description=__doc__)
    parser.add_argument("--seed", type=int, default=0, help="of all worlds (0)")
    parser.add_argument("--only", default="", metavar="WORD", help="worlds with this word in their names")
    parser.add_argument("--minutes", type=float, default=8.0, help="of driving that is proposed (8)")
    parser.add_argument("--results", type=Path, default=Path("results/deciding"), help="folder of tables and answers")
    options = parser.parse_args(arguments)
    options.results.mkdir(parents=True, exist_ok=True)
    found = []
    for one in (*narrow(options.seed), *tied(options.seed)):
        if options.only in one.name:
            found.append(decided(one, options.minutes, options.seed, options.results))
            print(json.dumps(found[-1]), flush=True)
    (options.results / "decided.json").write_text(json.dumps(found, indent=1) + "\n")
    print(f"{sum(bool(one['right']) for one in found)} of {len(found)} right")
    return 0


if __name__ == "__main__":
    sys.exit(main())
