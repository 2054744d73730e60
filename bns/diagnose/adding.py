"""A model extended: effects added, all numbers refitted, and written down with their intervals and where they come from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from bns.diagnose.data.load import Measured
from bns.diagnose.estimate.cross_validation import errors_at_horizons, held_out_steps
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.parallel import one_thread_each
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.estimate.trial_clock_test import with_trial_clocks
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.horizons import noise_floor
from bns.errors import ModelError
from bns.physics.effect import Effect
from bns.physics.effects import all_effects, effect_in_file, effect_named
from bns.physics.formula import formula_effect
from bns.physics.model import ActiveEffect, Model


@dataclass(frozen=True)
class ErrorStep:
    """One step: the effect that was added ("nominal" for the first), and the held-out error at each horizon (m)."""

    name: str
    error: Mapping[str, float]


@dataclass(frozen=True)
class ExtendedModel:
    """The refitted model, the errors of the steps to it, and the error that noise alone would show, at each horizon (m)."""

    fit: Fit
    model: Model
    error_by_step: tuple[ErrorStep, ...]
    floor: Mapping[str, float]


def effect_from(text: str, term: str | None = None, on: str | None = None) -> tuple[Effect, dict[str, str]]:
    """The effect of a name, a Python file, or a formula; and how a model file says so."""
    if term is not None:
        return formula_effect(text, term, on or "v"), {"term": term, "on": on or "v"}
    if text.endswith(".py"):
        return effect_in_file(Path(text)), {"file": str(Path(text).resolve())}
    return effect_named(text), {}


@one_thread_each()
def add_effects(
    predictor: Predictor,
    model: Model,
    effects: Sequence[tuple[Effect, Mapping[str, str]]],
    measured: Measured,
    per_trial: bool = False,
) -> ExtendedModel:
    """Add effects one after the other, each fitted with all before it; ModelError if the model has one already.

    ``per_trial``: an effect that may differ from trial to trial does.
    """
    if per_trial and not any(effect.per_trial_allowed for effect, _ in effects):
        able = ", ".join(e.name for e in all_effects().values() if e.per_trial_allowed)
        given = ", ".join(e.name for e, _ in effects)
        raise ModelError(f"None of {given} may differ from trial to trial; --per-trial goes with {able}.")
    for effect, _ in effects:
        if any(a.effect.name == effect.name for a in model.effects):
            raise ModelError(
                f"The model {model.name} has {effect.name} already; it is refitted whenever something is added."
            )
    problem = problem_for(predictor, model)
    fit = problem.fit(model)
    error_by_step = [
        ErrorStep("nominal", errors_at_horizons(predictor, held_out_steps(predictor, problem.pose_filter, fit.model)))
    ]
    for effect, written in effects:
        fit = fit_with(problem, fit, effect)
        problem = problem_for(predictor, fit.model, problem.pose_filter.noise)
        added = _written(fit.model, effect.name, written)
        fit = problem.fit(with_trial_clocks(added, effect.name) if per_trial and effect.per_trial_allowed else added)
        steps = held_out_steps(predictor, problem.pose_filter, fit.model)
        error_by_step.append(ErrorStep(effect.name, errors_at_horizons(predictor, steps)))
    floor = {
        h: noise_floor(predictor, problem.pose_filter.noise, h).get("position_m", np.nan)
        for h in error_by_step[0].error
    }
    return ExtendedModel(fit, _documented(fit, model, measured, error_by_step), tuple(error_by_step), floor)


def _written(model: Model, name: str, written: Mapping[str, str]) -> Model:
    return replace(
        model, effects=tuple(replace(a, written=written) if a.effect.name == name else a for a in model.effects)
    )


def _documented(fit: Fit, before: Model, measured: Measured, error_by_step: Sequence[ErrorStep]) -> Model:
    """The fitted model with intervals, reasons and provenance."""
    reason = f"fitted to {len(measured.tracks)} trials of {measured.path.name} ({measured.digest})"
    effects = tuple(_with_interval(fit, active, reason) for active in fit.model.effects)
    provenance = {
        "begun_from": before.name,
        "data": measured.path.name,
        "data_sha256": measured.digest,
        "date": datetime.now(UTC).strftime("%Y-%m-%d"),
        "trials": len(measured.tracks),
        "held_out_position_error_m": {
            step.name: {h: round(float(v), 6) for h, v in step.error.items()} for step in error_by_step
        },
    }
    return replace(fit.model, effects=effects, provenance=provenance)


def _with_interval(fit: Fit, active: ActiveEffect, reason: str) -> ActiveEffect:
    intervals = {f.parameter.name: fit.interval(i) for i, f in enumerate(fit.free) if f.effect == active.effect.name}
    if active.trial_values:
        unit = active.effect.parameters[0].unit
        reason += f"; the mean of one value a trial, {min(active.trial_values):+.3f} to {max(active.trial_values):+.3f} {unit}"
    return replace(active, basis="fitted", reason=reason, intervals=intervals)


def model_yaml(model: Model) -> str:
    """A model as the text of a YAML file that `load_model` reads back."""
    tree: dict[str, Any] = {"base": model.base, "wheelbase_m": model.wheelbase_m, "dt_s": model.dt_s}
    if model.jitter_relative:
        tree["jitter"] = {
            "wheel_speed_relative": model.jitter_relative,
            "basis": "guess",
            "reason": "as in the model before",
        }
    if model.noise_position_m or model.noise_heading_rad:
        tree["noise"] = {
            "position_m": model.noise_position_m,
            "heading_rad": model.noise_heading_rad,
            "basis": "guess",
            "reason": "as in the model before",
        }
    tree["effects"] = [_entry(active) for active in model.effects]
    if model.provenance:
        tree["provenance"] = dict(model.provenance)
    return yaml.safe_dump(tree, sort_keys=False, width=120, allow_unicode=True)


def _entry(active: ActiveEffect) -> dict[str, Any]:
    entry: dict[str, Any] = {"name": active.effect.name, **active.written}
    if active.per_trial:
        entry["per_trial"] = True
    entry["values"] = {name: _exact(value) for name, value in active.by_name.items()}
    entry["units"] = {p.name: p.unit for p in active.effect.parameters}
    if active.intervals:
        entry["intervals"] = {n: [_exact(low), _exact(high)] for n, (low, high) in active.intervals.items()}
    return {**entry, "basis": active.basis, "reason": active.reason or "not given"}


def _exact(value: float) -> float:
    """A float that PyYAML writes so that it reads it back as a number."""
    return float(value)
