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
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from bns.diagnose.diagnosis import Diagnosis, diagnose
from bns.diagnose.evidence import held_out_gain
from bns.diagnose.limits import arena_of, bounds_of
from bns.diagnose.power import told_apart
from bns.diagnose.proposal import propose
from bns.diagnose.rivals import refitted, rivals_of
from bns.diagnose.search import problem_for
from bns.diagnose.sequences import Arena, Bounds, Sequences, drawn, uniform
from bns.diagnose.tracks import tracks_of
from bns.diagnose.wheels import WheelPredictor
from bns.physics.effects import all_effects
from bns.physics.model import load_model
from bns.plotting import OKABE_ITO, PAGE_IN, save, style
from tests.hidden_effects.camera import Camera, Layout, track
from tests.hidden_effects.driving import ROBOTS, Driving
from tests.hidden_effects.listed import cause
from tests.hidden_effects.luck import luck
from tests.hidden_effects.motion import move
from tests.hidden_effects.world import Parameters, motor_jitter

ROBOT, JITTER, CAMERA = ROBOTS["khepera"], 0.004, Camera(0.003, 0.01, lost=0.0)
MINUTES = 8.0
STEP_S = 4e-3


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
    count, most = plan.duration_s.shape
    edges = np.concatenate([np.zeros((count, 1)), np.cumsum(plan.duration_s, axis=1)], axis=1)
    wheels = np.stack([plan.left_m_s, plan.right_m_s], axis=2)
    counts = (plan.duration_s > 0).sum(axis=1)
    begins = np.concatenate([[0.0], np.cumsum(plan.lasting_s + 5.0)[:-1]])
    driving = Driving(wheels, edges, counts, np.tile(np.array(start), (count, 1)), begins)
    words = (case.truth, case.rival, name)
    jitter = motor_jitter(luck(seed, *words, "jitter"), (count, most, 2), JITTER)
    hidden = [cause(case.truth, case.hidden)]
    paths = move(driving, ROBOT.wheelbase_m, hidden, jitter, luck(seed, *words), case.layout.tail_s, STEP_S)
    table = track(luck(seed, *words, "camera"), paths, driving, hidden, CAMERA, case.layout)
    table["trial"] = name + table["trial"].astype(str)
    return table


def decided(d: Diagnosis, case: Case, table: pd.DataFrame) -> bool:
    """Does the true explanation beat every rival on these measurements, by the diagnosis' own criterion?"""
    assert d.found is not None
    model = load_model("khepera")
    predictor = WheelPredictor(tracks_of(table))
    rivals, effects = rivals_of(d), all_effects()
    true = next(r for r in rivals if r.names == (case.truth,))
    problem = problem_for(predictor, true.fit.model)
    nothing = problem.fit(model)
    best = refitted(problem, problem.fit(true.fit.model), (case.truth,), effects)
    worth = held_out_gain(nothing.held_out, best.held_out)[0]
    others = [refitted(problem, problem.fit(r.fit.model), r.names, effects) for r in rivals if r.names != (case.truth,)]
    gains = [held_out_gain(other.held_out, best.held_out) for other in others]
    return all(bool(told_apart(np.array(gain), np.array(se), worth, len(best.held_out))) for gain, se in gains)


def minutes_until_decided(d: Diagnosis, case: Case, old: pd.DataFrame, new: pd.DataFrame, plan: Sequences) -> float:
    """Minutes of driving beyond the first look until it is decided, by bisection over a plan's trials; inf if never within it."""
    names = list(dict.fromkeys(new["trial"]))

    def enough(trials: int) -> bool:
        return decided(d, case, pd.concat([old, new[new["trial"].isin(names[:trials])]], ignore_index=True))

    if not enough(len(names)):
        return float("inf")
    low, high = 0, len(names)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return float(plan.lasting_s[:high].sum() / 60)


def measured_case(case: Case, seed: int) -> dict[str, object] | None:
    """Minutes for proposed and for random commands; None where the first look already decided, or did not name both."""
    old = driven(case, first_look(case, seed), (0.0, 0.0, np.pi / 2), seed, "first")
    model = load_model("khepera")
    predictor = WheelPredictor(tracks_of(old))
    d = diagnose(predictor, model)
    names = {rival.names for rival in rivals_of(d)}
    if d.verdict not in {"tie", "insufficient-data"} or not {(case.truth,), (case.rival,)} <= names:
        print(f"{case.truth} / {case.rival}: {d.verdict} {sorted(names)}", file=sys.stderr)
        return None
    arena = arena_of(predictor.tracks, "1.6x1.2", "0,0,90")
    bounds = bounds_of(predictor.tracks, model, None)
    plan = propose(d, arena, bounds, MINUTES, seed=seed).plan
    if not len(plan):
        print(f"{case.truth} / {case.rival}: no commands would decide", file=sys.stderr)
        return None
    plain = random_plan(arena, bounds, len(plan), seed)
    out: dict[str, object] = {"truth": case.truth, "rival": case.rival, "seed": seed, "verdict": d.verdict}
    for kind, one in (("proposed", plan), ("random", plain)):
        new = driven(case, one, arena.start, seed, kind)
        out[kind] = minutes_until_decided(d, case, old, new, one)
    return out


def random_plan(arena: Arena, bounds: Bounds, trials: int, seed: int) -> Sequences:
    """As many plain random trials."""
    return drawn(luck(seed, "random"), trials, bounds, arena, ROBOT.wheelbase_m, uniform(bounds))


@style()
def figure(found: Sequence[dict[str, object]], stem: Path) -> Path:
    """Minutes of driving, proposed against random, one dot a world."""
    pairs = list(dict.fromkeys((str(f["truth"]), str(f["rival"])) for f in found))
    drawn_ = Figure(figsize=(PAGE_IN, 0.34 * len(pairs) + 1.3))
    axes = drawn_.subplots()
    shown = {"random": (0.14, OKABE_ITO[1], "s"), "proposed": (-0.14, OKABE_ITO[0], "o")}
    for row, pair in enumerate(pairs[::-1]):
        for kind, (shift, colour, marker) in shown.items():
            values = [float(str(f[kind])) for f in found if (f["truth"], f["rival"]) == pair]
            late = [MINUTES * 1.25 if np.isinf(v) else v for v in values]
            axes.plot(late, [row + shift] * len(late), marker, color=colour, label=kind if row == 0 else None)
            axes.plot([np.median(late)] * 2, [row + shift - 0.12, row + shift + 0.12], color=colour)
    axes.set_yticks(range(len(pairs)), [f"{truth}, not {rival}" for truth, rival in pairs[::-1]])
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set_xlabel(f"minutes of driving until decided (dots beyond {MINUTES:g}: not decided; strokes: medians)")
    axes.legend(title="commands", loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return save(drawn_, stem)[0]


def main(arguments: list[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.hidden_effects.proposing", description=__doc__)
    parser.add_argument("--seeds", type=int, default=3, help="worlds a pair (3)")
    parser.add_argument("--only", default="", metavar="WORD", help="pairs with this word in their names")
    parser.add_argument("--results", type=Path, default=Path("results/propose"), help="folder of the numbers and the figure")
    options = parser.parse_args(arguments)
    options.results.mkdir(parents=True, exist_ok=True)
    found = []
    for case in (c for c in CASES if options.only in f"{c.truth} {c.rival}"):
        for seed in range(options.seeds):
            one = measured_case(case, seed)
            if one is not None:
                found.append(one)
                print(json.dumps(one), flush=True)
    (options.results / "robot-time.json").write_text(json.dumps(found, indent=1) + "\n")
    if found:
        print(figure(found, options.results / "robot-time"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
