"""A selection's numbers as plain values: what JSON, tables and pages show of it, each worked out in one place."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import stdtrit

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.predict.paired_errors import PairedErrors, plain
from bns.diagnose.residuals.along_variables import ResidualDependence
from bns.diagnose.residuals.symbolic import Formula
from bns.diagnose.select.result import Candidate, SelectionResult
from bns.physics.model import ActiveEffect


def before_and_after(errors: PairedErrors) -> dict[str, dict[str, float | int | None]]:
    """At every horizon: root mean square and median before and after (m), the change with its interval, windows, noise."""
    out: dict[str, dict[str, float | int | None]] = {}
    for horizon, e in errors.horizons.items():
        before, after, change = e.models[0], e.models[-1], e.total
        out[horizon] = {
            "before": plain(before.rms_m),
            "after": plain(after.rms_m),
            "noise_floor": plain(e.noise_floor_m),
            "median_before": plain(before.median_m),
            "median_after": plain(after.median_m),
            "change": plain(change.change_m) if change else None,
            "change_low": plain(change.low_m) if change else None,
            "change_high": plain(change.high_m) if change else None,
            "windows": e.windows,
            "windows_left_out": e.left_out,
        }
    return out


def numbers_of(fit: Fit) -> dict[str, dict[str, dict[str, Any]]]:
    """{effect: {name: value, se, low, high, unit, at_bound}} of a fitted model."""
    out: dict[str, dict[str, dict[str, Any]]] = {}
    per_trial_effect = fit.model.per_trial_effect
    if per_trial_effect is not None:
        out[per_trial_effect.effect.name] = _spread(per_trial_effect)
    for index, number in enumerate(fit.free):
        p, (low, high) = number.parameter, fit.interval(index)
        out.setdefault(number.effect, {})[p.name] = {
            "value": plain(fit.values[index]),
            "se": plain(fit.se(index)),
            "low": plain(low),
            "high": plain(high),
            "unit": p.unit,
            "at_bound": bool(fit.values[index] in {p.low, p.high}),
        }
    return out


def numbers_of_term(term: Formula) -> dict[str, dict[str, Any]]:
    """As `numbers_of`, of a term; k2 before k10."""
    return dict(sorted(numbers_of(term.fit)[term.name].items(), key=lambda item: (len(item[0]), item[0])))


def _spread(per_trial_effect: ActiveEffect) -> dict[str, dict[str, Any]]:
    """The mean and the standard deviation of the trials' own values, with their intervals."""
    p, own = per_trial_effect.effect.parameters[0], np.array(per_trial_effect.trial_values)
    scatter = float(own.std(ddof=1))
    se = scatter / np.sqrt(len(own))
    half = float(stdtrit(len(own) - 1, 0.975)) * se
    mean = {"value": float(own.mean()), "se": se, "low": float(own.mean()) - half, "high": float(own.mean()) + half}
    loose = scatter / np.sqrt(2 * (len(own) - 1))
    between = {"value": scatter, "se": loose, "low": max(scatter - 1.96 * loose, 0.0), "high": scatter + 1.96 * loose}
    always = {"unit": p.unit, "at_bound": False}
    return {p.name: {**mean, **always, "per_trial": True}, f"between_trials_{p.unit}": {**between, **always}}


def ties_of(selection: SelectionResult) -> list[list[str]]:
    """`tied_sets` in words: of two effects that stand for one together, the names are joined by "+"."""
    return [sorted("+".join(names) for names in group) for group in tied_sets(selection)]


def tied_sets(selection: SelectionResult) -> list[list[tuple[str, ...]]]:
    """Groups of what stands for each other: exchange one of a group for another, and the tracks are explained as well."""
    groups: list[set[tuple[str, ...]]] = []
    for competitor in selection.competing_models:
        gone = tuple(name for name in selection.accepted if name not in competitor)
        come = tuple(name for name in competitor if name not in selection.accepted)
        group = {gone, come} if 0 < len(gone) < len(come) else {(name,) for name in (*gone, *come)}
        touching = [g for g in groups if g & group]
        groups = [g for g in groups if g not in touching] + [group.union(*touching)]
    return [sorted(g) for g in groups]


def ranked_values(candidate: Candidate) -> dict[str, Any]:
    """A candidate alone: what it earns, its numbers, why it was not taken."""
    comparison = candidate.paired_comparison
    return {
        "name": candidate.name,
        "elpd_diff": plain(comparison.elpd_diff),
        "dse": plain(comparison.dse),
        "p_value": comparison.p_value,
        "parameters": numbers_of(candidate.fit).get(candidate.name, {}),
        "rejected_because": candidate.rejected_because,
    }


def dependence_values(p: ResidualDependence) -> dict[str, Any]:
    """What a free curve along a variable earns."""
    return {
        "variable": p.variable,
        "velocity": p.channel,
        "elpd_diff": plain(p.paired_comparison.elpd_diff),
        "dse": plain(p.paired_comparison.dse),
        "p_value": p.paired_comparison.p_value,
        "share": plain(p.share),
    }
