"""The whole diagnosis: from tracks and a model to a verdict that says how sure it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import t as student

from bns.diagnose.caveats import notes_on
from bns.diagnose.data.tracks import Tracks
from bns.diagnose.estimate.cross_validation import errors_at_horizons, held_out_steps
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.parallel import one_thread_each
from bns.diagnose.estimate.significance import fewest_trials
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.horizons import HORIZONS, noise_floor
from bns.diagnose.residuals.along_variables import ResidualDependence, residual_dependence
from bns.diagnose.residuals.symbolic import Formula, best_formula
from bns.diagnose.residuals.unexplained import Unexplained, unexplained
from bns.diagnose.select.equivalents import equivalent_pairs
from bns.diagnose.select.stepwise import FALSE_ALARM, MIN_GAIN, Candidate, SelectionResult, StepwiseSelection
from bns.physics.effect import Effect
from bns.physics.model import ActiveEffect, Model

VERDICTS = ("none", "effects", "tie", "unlisted", "insufficient-data")
FEW_TRIALS = 40
_HINT = 3.0
"""A candidate whose chance is within this factor of what would be accepted is a hint that more trials would settle."""


NOTHING_LEFT = Unexplained((), None, ())


@dataclass(frozen=True)
class Diagnosis:
    """A verdict and everything it rests on. ``selection`` is None where there was too little to search."""

    verdict: str
    selection: SelectionResult | None
    residual_dependence: tuple[ResidualDependence, ...] = ()
    rest: Unexplained = NOTHING_LEFT
    formula: Formula | None = None
    error: Mapping[str, Mapping[str, float]] | None = None
    notes: tuple[str, ...] = ()

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the accepted effects, in the order in which they were found."""
        return self.selection.accepted if self.selection else ()

    @property
    def model(self) -> Model | None:
        """The model refitted with all accepted effects."""
        return self.selection.fit.model if self.selection else None

    def as_json(self) -> dict[str, Any]:
        """One object of plain values, as `bns diagnose --json` prints it."""
        selection = self.selection
        return {
            "verdict": self.verdict,
            "effects": list(self.effects),
            "parameters": numbers_of(selection.fit) if selection else {},
            "ties": ties_of(selection) if selection else [],
            "explanations": [list(selection.accepted), *map(list, selection.competing_models)] if selection else [],
            "ranking": [_ranked(c) for c in (selection.steps[0].ranking if selection else ())],
            "error": {h: {name: _plain(v) for name, v in e.items()} for h, e in (self.error or {}).items()},
            "formula": self._formula(),
            "residual_dependence": [_pattern(p) for p in self.residual_dependence],
            "outliers": [vars(o) for o in self.rest.outliers],
            "notes": list(self.notes),
        }

    def _formula(self) -> dict[str, Any] | None:
        if self.formula is None:
            return None
        comparison = self.formula.paired_comparison
        return {
            "on": self.formula.on,
            "term": self.formula.term,
            "values": {k: _plain(v) for k, v in self.formula.values.items()},
            "elpd_diff": _plain(comparison.elpd_diff),
            "dse": _plain(comparison.dse),
            "p_value": comparison.p_value,
        }


@one_thread_each()
def diagnose(
    predictor: Predictor,
    model: Model,
    *,
    extra: Mapping[str, Effect] | None = None,
    tick: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """What the model lacks on these tracks."""
    search = StepwiseSelection(predictor, model, extra, tick)
    reason = too_little(predictor.tracks, fewest_trials(search.level))
    if reason:
        return Diagnosis("insufficient-data", None, notes=(reason,))
    selection = search.run()
    tick("what is left")
    dependence = residual_dependence(selection.problem, selection.fit)
    rest = unexplained(selection.problem, selection.fit, dependence)
    # too few trials may show a place for its curve to be certain; it is the best guess where moments stand out
    guesses = rest.residual_dependence or (tuple(dependence[:1]) if rest.outliers else ())
    formula = best_formula(selection.problem, selection.fit, guesses) if guesses else None
    hint = _hint(selection, len(predictor.tracks))
    verdict = _verdict(selection, rest.any, hint)
    tick("longer explanations")
    others = [
        effect for name, effect in listed(selection.nominal.model, extra).items() if name not in selection.accepted
    ]
    pairs = [] if rest.any else equivalent_pairs(selection.problem, selection.fit, selection.accepted, others)
    tick("errors on trials held out")
    return Diagnosis(
        verdict,
        selection,
        tuple(dependence[:12]),
        rest,
        formula,
        errors_before_and_after(selection),
        tuple(notes_on(selection, predictor.tracks, rest, formula, hint, pairs)),
    )


def too_little(tracks: Tracks, fewest: int) -> str:
    """Why nothing can be concluded from these tracks, of which there must be so many; "" if something may."""
    if len(tracks) < fewest:
        return (
            f"{len(tracks)} trials: whatever they show could be luck. {fewest} trials are the least, "
            "20 or more find what is large, 60 what is small."
        )
    frames = np.diff(tracks.first)
    if np.median(frames) < 2:
        return (
            "Most trials have a single tracked pose; a displacement needs two: log the pose before and after commands."
        )
    if not ((np.abs(tracks.left_m_s) + np.abs(tracks.right_m_s)) * tracks.duration_s).any():
        return "The robot was never told to move; give it commands of different speeds."
    ends = [tracks.pose[a:b, :2] for a, b in zip(tracks.first[:-1], tracks.first[1:], strict=True)]
    if max(float(np.ptp(p, axis=0).max()) for p in ends if len(p)) < 5e-3:
        return "The robot never moved by more than 5 mm, whatever it was told: is it tracked, are its motors on?"
    return ""


def _verdict(selection: SelectionResult, unexplained: bool, hint: Candidate | None) -> str:
    if unexplained:
        return "unlisted"
    if selection.competing_models:
        return "tie"
    if selection.accepted:
        return "effects"
    return "insufficient-data" if hint else "none"


def _hint(selection: SelectionResult, trials: int) -> Candidate | None:
    """The best candidate of a search that accepted nothing, where few trials nearly sufficed."""
    if selection.accepted or trials >= FEW_TRIALS:
        return None
    step, least = selection.steps[0], MIN_GAIN * float(selection.nominal.losses.mean())
    level = _HINT * FALSE_ALARM / len(step.ranking)
    near = [
        c
        for c in step.ranking
        if not c.rejected_because
        and c.paired_comparison.p_value < level
        and c.paired_comparison.z > 2
        and c.paired_comparison.elpd_diff > max(step.decoy_threshold, least)
    ]
    return near[0] if near else None


def errors_before_and_after(selection: SelectionResult) -> dict[str, dict[str, float]]:
    """Held-out position error (m) at every horizon: nominal model, with the accepted effects, and what noise alone would show."""
    predictor, pose_filter = selection.problem.predictor, selection.problem.pose_filter
    before = errors_at_horizons(predictor, held_out_steps(predictor, pose_filter, selection.nominal.model))
    after = errors_at_horizons(predictor, held_out_steps(predictor, pose_filter, selection.fit.model))
    return {
        h: {
            "before": before[h],
            "after": after[h],
            "noise_floor": noise_floor(predictor, pose_filter.noise, h).get("position_m", float("nan")),
        }
        for h in HORIZONS
    }


def numbers_of(fit: Fit) -> dict[str, dict[str, dict[str, Any]]]:
    """{effect: {name: value, se, low, high, unit, at_bound}} of a fitted model."""
    out: dict[str, dict[str, dict[str, Any]]] = {}
    per_trial_effect = fit.model.per_trial_effect
    if per_trial_effect is not None:
        out[per_trial_effect.effect.name] = _spread(per_trial_effect)
    for index, number in enumerate(fit.free):
        p, (low, high) = number.parameter, fit.interval(index)
        out.setdefault(number.effect, {})[p.name] = {
            "value": _plain(fit.values[index]),
            "se": _plain(fit.se(index)),
            "low": _plain(low),
            "high": _plain(high),
            "unit": p.unit,
            "at_bound": bool(fit.values[index] in {p.low, p.high}),
        }
    return out


def _spread(per_trial_effect: ActiveEffect) -> dict[str, dict[str, Any]]:
    """The mean and the standard deviation of the trials' own values, with their intervals."""
    p, own = per_trial_effect.effect.parameters[0], np.array(per_trial_effect.trial_values)
    scatter = float(own.std(ddof=1))
    se = scatter / np.sqrt(len(own))
    half = float(student.ppf(0.975, len(own) - 1)) * se
    mean = {"value": float(own.mean()), "se": se, "low": float(own.mean()) - half, "high": float(own.mean()) + half}
    loose = scatter / np.sqrt(2 * (len(own) - 1))
    between = {"value": scatter, "se": loose, "low": max(scatter - 1.96 * loose, 0.0), "high": scatter + 1.96 * loose}
    always = {"unit": p.unit, "at_bound": False}
    return {p.name: {**mean, **always, "per_trial": True}, f"between_trials_{p.unit}": {**between, **always}}


def ties_of(selection: SelectionResult) -> list[list[str]]:
    """Groups of names that stand for each other: exchange one of a group for another, and the tracks are explained as well."""
    groups: list[set[str]] = []
    for competitor in selection.competing_models:
        group = set(selection.accepted) ^ set(competitor)
        touching = [g for g in groups if g & group]
        groups = [g for g in groups if g not in touching] + [group.union(*touching)]
    return [sorted(g) for g in groups]


def _ranked(candidate: Candidate) -> dict[str, Any]:
    comparison = candidate.paired_comparison
    return {
        "name": candidate.name,
        "elpd_diff": _plain(comparison.elpd_diff),
        "dse": _plain(comparison.dse),
        "p_value": comparison.p_value,
        "parameters": numbers_of(candidate.fit).get(candidate.name, {}),
        "rejected_because": candidate.rejected_because,
    }


def _pattern(p: ResidualDependence) -> dict[str, Any]:
    return {
        "variable": p.variable,
        "velocity": p.channel,
        "elpd_diff": _plain(p.paired_comparison.elpd_diff),
        "dse": _plain(p.paired_comparison.dse),
        "p_value": p.paired_comparison.p_value,
        "share": _plain(p.share),
    }


def _plain(value: float) -> float | None:
    """A float that JSON knows."""
    return float(value) if np.isfinite(value) else None
