"""The next experiment: trials inside the arena that discriminate between competing models in the least robot time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from bns.diagnose.data.tracks import Array
from bns.diagnose.design.competing_models import (
    CompetingModel,
    competing_models_of,
    model_pairs_of,
    with_exact_delays,
    without_last,
)
from bns.diagnose.design.discrimination import Discrimination, ExperimentSetup, Pair
from bns.diagnose.design.independent_measurement import independent_measurements
from bns.diagnose.design.planners import Planner, WheelPlanner
from bns.diagnose.design.power import (
    LONGEST_MINUTES,
    TARGET_POWER,
    ExpectedGain,
    PastTrials,
    decision_probability,
    expected_standard_errors,
    least_minutes,
    minutes_needed,
    negligible_difference,
    overdispersion_of,
)
from bns.diagnose.design.repeats import RepeatPlanner, Repeats
from bns.diagnose.design.search import Pool
from bns.diagnose.design.sequences import Arena, Bounds, Sequences
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.noise import huber
from bns.diagnose.estimate.significance import fewest_trials
from bns.diagnose.parallel import one_thread_each
from bns.diagnose.predict.base import Predictor
from bns.diagnose.select.stepwise import FALSE_ALARM
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.physics.effects import all_effects

MOST_FASTER = DEFAULTS.design.most_faster
ALIKE_RMS = DEFAULTS.design.alike_rms
LEAST_ERRORS = DEFAULTS.design.least_standard_errors
_DENSE = DEFAULTS.design.dense
_POINTS = DEFAULTS.design.power_points


@dataclass(frozen=True)
class ModelPair:
    """Two explanations: how likely the experiment decides between them, and after how many minutes (nine times in ten).

    ``indistinguishable``: no command sequence tells them apart; ``independent_measurements`` would.
    ``times_faster``: as many times as long plain random commands would take.
    ``already_decided``: what was measured so far decides. ``power_by_minutes``: minutes of the planned driving and the
    chance of a decision by then; empty where no commands would decide. ``standard_errors``: how large the difference is expected
    to be after the experiment, whichever is true; the diagnosis takes 2 (`tie_z`) for decided.
    """

    first: str
    second: str
    power: float
    minutes: float
    times_faster: float
    indistinguishable: bool
    already_decided: bool
    independent_measurements: tuple[str, ...]
    power_by_minutes: tuple[tuple[float, float], ...] = ()
    standard_errors: float = math.inf

    @property
    def no_decision(self) -> bool:
        """Would commands decide, but hardly any experiment of this length?"""
        return not (self.indistinguishable or self.already_decided) and self.standard_errors < LEAST_ERRORS


@dataclass(frozen=True)
class Proposal:
    """An experiment. ``plan`` has no trials where no commands, or none of this length, would tell anything.

    ``arena``, ``bounds``: of a robot on wheels; None for one on joints, which repeats cycles.
    """

    verdict: str
    competing_models: tuple[CompetingModel, ...]
    model_pairs: tuple[ModelPair, ...]
    plan: Sequences | Repeats
    arena: Arena | None
    bounds: Bounds | None
    minutes: float
    predictor: Predictor | None = None
    """Of a robot on joints: what foresees its cycles."""

    @property
    def power(self) -> float:
        """Chance that every pair is decided that commands can decide: that of the hardest one; 0 where there is none."""
        return min((c.power for c in self.model_pairs if not c.indistinguishable), default=0.0)

    def commands(self) -> pd.DataFrame:
        """The trial file: trial, left_m_s, right_m_s, duration_s, and the pose each trial starts from; or `Repeats.commands`."""
        if isinstance(self.plan, Repeats):
            return self.plan.commands()
        assert self.arena is not None
        rows = [
            (trial, left, right, lasts, *self.arena.start)
            for trial in range(len(self.plan))
            for left, right, lasts in zip(
                self.plan.left_m_s[trial], self.plan.right_m_s[trial], self.plan.duration_s[trial], strict=True
            )
            if lasts > 0
        ]
        names = ["trial", "left_m_s", "right_m_s", "duration_s", "start_x_m", "start_y_m", "start_heading_rad"]
        table = pd.DataFrame(rows, columns=names)
        return table.round(dict(zip(names[1:], (5, 5, 3, 4, 4, 5), strict=True)))

    def as_json(self) -> dict[str, Any]:
        """One object of plain values."""
        commands = self.commands()
        if self.arena is not None:
            commands = commands.iloc[:, :4]
        return {
            "verdict": self.verdict,
            "competing_models": [list(r.names) for r in self.competing_models],
            "power": self.power,
            "minutes": float(self.plan.lasting_s.sum() / 60),
            "model_pairs": [{name: _plain(value) for name, value in vars(c).items()} for c in self.model_pairs],
            **({} if self.arena is None else _arena_json(self.arena)),
            "trials": len(self.plan),
            "commands": commands.to_dict("records"),
        }


def _arena_json(arena: Arena) -> dict[str, Any]:
    return {
        "start": {"x_m": arena.start[0], "y_m": arena.start[1], "heading_rad": arena.start[2]},
        "arena": {k: v for k, v in vars(arena).items() if k != "start"},
    }


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not np.isfinite(value) else value


@one_thread_each()
def propose(
    d: Diagnosis,
    arena: Arena | None,
    bounds: Bounds | None,
    minutes: float,
    *,
    seed: int = 0,
    tick: Callable[[str], None] = lambda _: None,
) -> Proposal:
    """The experiment of about ``minutes`` that discriminates between the diagnosis' models; DataError if there are none.

    ``arena``, ``bounds``: of a robot on wheels.
    """
    tick("competing models")
    competing_models = competing_models_of(d)
    if len(competing_models) < 2:
        why = "; ".join(d.notes) or "no effect explains a notable part"
        raise DataError(
            f"No two explanations are left that an experiment could tell apart (verdict {d.verdict}): {why}"
        )
    assert d.selection is not None
    problem, competing_models = with_exact_delays(d.selection.problem, competing_models)
    d = replace(d, selection=replace(d.selection, problem=problem))
    planner = _planner(d, competing_models, arena, bounds, minutes, tick)
    rng = np.random.default_rng(seed)
    past = {(a, b): _past(d, competing_models[a], competing_models[b]) for a, b in planner.pairs}
    best = planner.best(rng, competing_models, 60 * minutes, past)
    tick("random commands, for comparison")
    plain = planner.random(rng, competing_models, len(best.plan))
    tick("power")
    model_pairs = _model_pairs(d, competing_models, best, plain, planner, past)
    decidable = any(not (c.indistinguishable or c.no_decision) for c in model_pairs)
    plan = best.plan if decidable else best.plan.only(np.array([], dtype=np.int64))
    assert isinstance(plan, Sequences | Repeats)
    predictor = planner.problem.predictor if isinstance(planner, RepeatPlanner) else None
    return Proposal(d.verdict, competing_models, tuple(model_pairs), plan, arena, bounds, minutes, predictor)


def _planner(
    d: Diagnosis,
    competing_models: Sequence[CompetingModel],
    arena: Arena | None,
    bounds: Bounds | None,
    minutes: float,
    tick: Callable[[str], None],
) -> Planner:
    assert d.selection is not None
    problem, pairs = d.selection.problem, model_pairs_of(d, competing_models)
    if arena is None or bounds is None:
        return RepeatPlanner(problem, pairs)

    def session_s(plan: Sequences) -> Array:
        return np.linspace(0, 60 * minutes, len(plan), endpoint=False)

    return WheelPlanner(ExperimentSetup(problem, arena, _frame_s(d), session_s, pairs), bounds, tick)


def _model_pairs(
    d: Diagnosis,
    competing_models: tuple[CompetingModel, ...],
    best: Pool,
    plain: Pool,
    planner: Planner,
    past: Mapping[Pair, PastTrials],
) -> list[ModelPair]:
    assert d.selection is not None
    nothing = CompetingModel((), d.selection.problem.fit(without_last(d.selection)))
    last = len(competing_models)
    more = (*planner.pairs, *((a, last) for a in range(last)))
    models = [*competing_models, nothing]
    planned, random = (planner.discriminations(models, pool.plan, more) for pool in (best, plain))
    out = []
    for a, b in planner.pairs:
        one, other = competing_models[a], competing_models[b]
        scatter = past[(a, b)].scatter
        both, as_random = (
            (
                _expected(one, other, nothing, each[(a, b)][0], each[(a, last)][0], scatter),
                _expected(other, one, nothing, each[(a, b)][1], each[(b, last)][0], scatter),
            )
            for each in (planned, random)
        )
        minutes = _minutes(both, planned[(a, b)], best.plan.lasting_s, scatter)
        alike = all(one.rms() < ALIKE_RMS for one in planned[(a, b)])
        indistinguishable = alike or minutes > LONGEST_MINUTES or negligible_difference(both)
        longer = _minutes(as_random, random[(a, b)], plain.plan.lasting_s, scatter) / max(minutes, 1e-12)
        out.append(
            ModelPair(
                one.title,
                other.title,
                0.0 if indistinguishable else decision_probability(both),
                np.inf if indistinguishable else max(minutes, least_minutes(both, best.plan.lasting_s)),
                1.0 if indistinguishable else min(longer, MOST_FASTER),
                indistinguishable,
                decision_probability([e.first(0) for e in both]) >= TARGET_POWER,
                tuple(independent_measurements(one.effects, other.effects)),
                () if indistinguishable else _power_by_minutes(both, best.plan.lasting_s),
                0.0 if indistinguishable else sum(e.chance * expected_standard_errors(e) for e in both),
            )
        )
    return out


def _power_by_minutes(both: Sequence[ExpectedGain], lasting_s: Array) -> tuple[tuple[float, float], ...]:
    """(minutes, chance of a decision) after some of the planned trials, the last one too."""
    trials = np.unique(np.linspace(0, len(lasting_s), _POINTS).round().astype(int))
    minutes = np.concatenate([[0.0], np.cumsum(lasting_s) / 60])
    return tuple((float(minutes[n]), float(decision_probability([e.first(n) for e in both]))) for n in trials)


def _expected(
    true: CompetingModel,
    other: CompetingModel,
    nothing: CompetingModel,
    discrimination: Discrimination,
    worth: Discrimination,
    scatter: float,
) -> ExpectedGain:
    old = other.fit.held_out - true.fit.held_out
    chance = 1 / (1 + np.exp(-np.clip(old.sum() / scatter, -50, 50)))
    return ExpectedGain(
        old, discrimination.each(), nothing.fit.held_out - true.fit.held_out, worth.each(), scatter, float(chance)
    )


def _minutes(
    both: tuple[ExpectedGain, ExpectedGain],
    directions: tuple[Discrimination, Discrimination],
    lasting_s: Array,
    scatter: float,
) -> float:
    """Robot time until nine in ten such experiments decide: read off the plan's first trials, else predicted from all of them.

    Where the old trials decide already, what the new ones would take alone.
    """
    alone = decision_probability([e.first(0) for e in both]) >= TARGET_POWER
    if not alone and decision_probability(both) >= TARGET_POWER:
        low, high = 0, len(lasting_s)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (
                (low, middle)
                if decision_probability([e.first(middle) for e in both]) >= TARGET_POWER
                else (middle, high)
            )
        return float(lasting_s[:high].sum() / 60)
    whole = sum(e.chance * one.total() for e, one in zip(both, directions, strict=True))
    least = (
        fewest_trials(FALSE_ALARM / len(all_effects())) * float(lasting_s.mean() / 60)
        if alone and len(lasting_s)
        else 0.0
    )
    return max(minutes_needed(whole, float(lasting_s.sum() / 60), scatter), least)


def _past(d: Diagnosis, a: CompetingModel, b: CompetingModel) -> PastTrials:
    """From the trials seen so far: how gains held out vary, and how much more so than unit noise lets them.

    The latter from losses as fitted: those held out vary with the numbers, too, however close two explanations are.
    """
    assert d.selection is not None
    per_trial, held_out = d.selection.problem.per_trial, b.fit.held_out - a.fit.held_out
    difference = a.fit.whitened - b.fit.whitened
    fitted = per_trial(huber(b.fit.whitened) - huber(a.fit.whitened))
    scatter = overdispersion_of(fitted, per_trial((difference * difference).sum(axis=1)))
    return PastTrials(float(((held_out - held_out.mean()) ** 2).sum()), scatter)


def _frame_s(d: Diagnosis) -> float | None:
    """Time between frames of the tracks; None where poses come at the ends of commands only."""
    assert d.selection is not None
    tracks = d.selection.problem.predictor.tracks
    commands = (tracks.duration_s > 0).sum(axis=1)
    if float(np.median(np.diff(tracks.first) / np.maximum(commands, 1))) < _DENSE:
        return None
    steps = np.diff(tracks.t_s)[~tracks.is_first[1:]]
    return float(np.median(steps))
