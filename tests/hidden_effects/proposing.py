"""How much robot time until the diagnosis tells confusable explanations apart: proposed commands against random ones.

Worlds of this benchmark's own equations are first driven so narrowly that two explanations fit. Then trials are added, proposed
or random, as long, in the same arena and within the same bounds, until the true explanation beats every rival by the diagnosis'
own criterion.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.design.competing_models import competing_models_of, refitted
from bns.diagnose.design.limits import arena_of, bounds_of
from bns.diagnose.design.power import distinguished
from bns.diagnose.design.proposal import propose
from bns.diagnose.design.sequences import Arena, Bounds, Sequences, draw_sequences, uniform
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.significance import paired_elpd_diff
from bns.diagnose.predict.wheels import WheelPredictor
from bns.physics.effects import all_effects
from bns.physics.model import load_model
from tests.hidden_effects.camera import Camera, Layout
from tests.hidden_effects.driving import ROBOTS
from tests.hidden_effects.experiment import Look, carried_out
from tests.hidden_effects.listed import cause
from tests.hidden_effects.luck import luck
from tests.hidden_effects.robot_time import figure, summary
from tests.hidden_effects.world import Parameters

ROBOT, JITTER, CAMERA = ROBOTS["khepera"], 0.004, Camera(0.003, 0.01, lost=0.0)
MINUTES = 8.0


@dataclass(frozen=True)
class Case:
    """One hidden effect, what it is confused with, and how narrowly it was first looked at: speeds (m/s), turning (m/s between
    the wheels), durations (s)."""

    truth: str
    hidden: Parameters
    rival: str
    speeds: tuple[float, float] = (0.05, 0.2)
    turning: tuple[float, float] = (-0.1, 0.1)
    lasting: tuple[float, float] = (0.6, 2.0)
    layout: Layout = field(default_factory=lambda: Layout("ends"))
    trials: int = 14


ANCHOR = {"anchor_x_m": 0.6, "anchor_y_m": 0.3, "pull_per_s": 0.01}
CASES = (
    Case("dead-zone", {"width_m_s": 0.002}, "speed-gain", (0.09, 0.11), (-0.01, 0.01)),
    Case("speed-gain", {"gain": 0.98}, "camera-scale", (0.1, 0.12), (-0.02, 0.02)),
    Case("wheelbase", {"factor": 1.03}, "yaw-bias", (0.1, 0.12), (0.045, 0.05)),
    Case("yaw-bias", {"rate_rad_s": 0.02}, "wheel-mismatch", (0.11, 0.12), (-0.05, 0.05)),
    Case("wheel-mismatch", {"ratio": 1.012}, "yaw-bias", (0.11, 0.12), (-0.05, 0.05)),
    Case("motor-lag", {"tau_s": 0.12}, "command-delay", (0.08, 0.16), (-0.06, 0.06), (1.2, 2.4)),
    Case("acceleration-limit", {"max_m_s2": 0.8}, "motor-lag", (0.12, 0.14), (-0.01, 0.01), (1.2, 2.4)),
    Case("tether-pull", ANCHOR, "floor-slope", (0.05, 0.08), lasting=(0.6, 1.0)),
)


def first_look(case: Case, seed: int) -> Sequences:
    """The narrow commands."""
    rng = luck(seed, case.truth, case.rival, "first")
    shape = (case.trials, 6)
    speed, turning = rng.uniform(*case.speeds, shape), rng.uniform(*case.turning, shape)
    lasts = np.round(rng.uniform(*case.lasting, shape) / 0.04) * 0.04
    return Sequences(speed - turning / 2, speed + turning / 2, lasts)


def driven(case: Case, plan: Sequences, start: Sequence[float], seed: int, name: str) -> pd.DataFrame:
    """What the camera sees of a plan in the world of this case."""
    hidden, words = [cause(case.truth, case.hidden)], (case.truth, case.rival, name)
    table = carried_out(plan, start, hidden, Look(ROBOT.wheelbase_m, CAMERA, case.layout, JITTER), seed, words)
    table["trial"] = name + table["trial"].astype(str)
    return table


def decided(d: Diagnosis, case: Case, table: pd.DataFrame) -> bool:
    """Does the true explanation beat every rival on these measurements, by the diagnosis' own criterion?"""
    assert d.selection is not None
    model = load_model("khepera")
    predictor = WheelPredictor(tracks_of(table))
    rivals, effects = competing_models_of(d), all_effects()
    true = next(r for r in rivals if r.names == (case.truth,))
    problem = problem_for(predictor, true.fit.model)
    nothing = problem.fit(model)
    best = refitted(problem, problem.fit(true.fit.model), (case.truth,), effects)
    worth = paired_elpd_diff(nothing.held_out, best.held_out)[0]
    others = [refitted(problem, problem.fit(r.fit.model), r.names, effects) for r in rivals if r.names != (case.truth,)]
    gains = [paired_elpd_diff(other.held_out, best.held_out) for other in others]
    return all(bool(distinguished(np.array(gain), np.array(se), worth, len(best.held_out))) for gain, se in gains)


def minutes_until_decided(d: Diagnosis, case: Case, old: pd.DataFrame, new: pd.DataFrame, plan: Sequences) -> float:
    """Minutes of driving beyond the first look until it is decided, to the command; inf if never within the plan.

    Looked at after more and more trials, each time a third more; then by bisection over the commands since the last look.
    """
    marks = _marks(plan)

    def enough(count: int) -> bool:
        trial, until_s, _ = marks[count - 1]
        names = list(dict.fromkeys(new["trial"]))
        so_far = new["trial"].isin(names[:trial]) | ((new["trial"] == names[trial]) & (new["t_s"] <= until_s + 1e-6))
        return decided(d, case, pd.concat([old, new[so_far]], ignore_index=True))

    low = 0
    for high in _looks(marks):
        if enough(high):
            break
        low = high
    else:
        return float("inf")
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return marks[high - 1][2]


def _marks(plan: Sequences) -> list[tuple[int, float, float]]:
    """Every command's trial, its end in the trial (s), and the driving until then (min)."""
    marks, before_s = [], 0.0
    for trial, lasts in enumerate(plan.duration_s):
        ends = np.cumsum(lasts[lasts > 0])
        marks += [(trial, float(end), (before_s + float(end)) / 60) for end in ends]
        before_s += float(ends[-1])
    return marks


def _looks(marks: Sequence[tuple[int, float, float]]) -> list[int]:
    """After how many commands to look: at the ends of trials, of two first, then of a third more each time, at last of all."""
    ends = [count for count, (one, then) in enumerate(pairwise(marks), start=1) if then[0] != one[0]] + [len(marks)]
    trials = [2]
    while trials[-1] < len(ends):
        trials.append(min(max(trials[-1] + 1, trials[-1] * 4 // 3), len(ends)))
    return [ends[min(count, len(ends)) - 1] for count in trials]


def measured_case(case: Case, seed: int) -> dict[str, object] | None:
    """Minutes for proposed and for random commands; None where the first look already decided, or did not name both."""
    old = driven(case, first_look(case, seed), (0.0, 0.0, np.pi / 2), seed, "first")
    model = load_model("khepera")
    predictor = WheelPredictor(tracks_of(old))
    d = diagnose(predictor, model)
    names = {rival.names for rival in competing_models_of(d)}
    if d.verdict not in {"tie", "insufficient-data"} or not {(case.truth,), (case.rival,)} <= names:
        print(f"{case.truth} / {case.rival}: {d.verdict} {sorted(names)}", file=sys.stderr)
        return None
    arena = arena_of(predictor.tracks, (1.6, 1.2), (0.0, 0.0, np.pi / 2))
    bounds = bounds_of(predictor.tracks, model, None)
    plans = {"proposed": propose(d, arena, bounds, MINUTES, seed=seed).plan, "random": random_plan(arena, bounds, seed)}
    out: dict[str, object] = {"truth": case.truth, "rival": case.rival, "seed": seed, "verdict": d.verdict}
    for kind, plan in plans.items():
        if not len(plan):  # said to be beyond all commands: never decided
            out[kind] = float("inf")
            continue
        new = driven(case, plan, arena.start, seed, kind)
        out[kind] = minutes_until_decided(d, case, old, new, plan)
    return out


def random_plan(arena: Arena, bounds: Bounds, seed: int) -> Sequences:
    """Plain random trials that fill the time."""
    trials = int(np.ceil(60 * MINUTES / bounds.trial_s))
    return draw_sequences(luck(seed, "random"), trials, bounds, arena, ROBOT.wheelbase_m, uniform(bounds))


def main(arguments: list[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.hidden_effects.proposing", description=__doc__)
    parser.add_argument("--seeds", type=int, default=3, help="worlds a pair (3)")
    parser.add_argument(
        "--first-seed", type=int, default=0, help="first of them (0; 0 to 2 were looked at while building)"
    )
    parser.add_argument("--only", default="", metavar="WORD", help="pairs with this word in their names")
    parser.add_argument(
        "--results", type=Path, default=Path("results/propose"), help="folder of the numbers and the figure"
    )
    options = parser.parse_args(arguments)
    options.results.mkdir(parents=True, exist_ok=True)
    found = []
    for case in (c for c in CASES if options.only in f"{c.truth} {c.rival}"):
        for seed in range(options.first_seed, options.first_seed + options.seeds):
            one = measured_case(case, seed)
            if one is not None:
                found.append(one)
                print(json.dumps(one), flush=True)
    (options.results / "robot-time.json").write_text(json.dumps(found, indent=1) + "\n")
    if found:
        print(summary(found, MINUTES))
        print(figure(found, MINUTES, options.results / "robot-time"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
