"""A model extended: effects added, all numbers refitted, and written down with their intervals and where they come from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from bns.diagnose.data.load import Measured
from bns.diagnose.effect_caveats import on_numbers
from bns.diagnose.estimate.clocks.trial_clock_test import with_trial_clocks
from bns.diagnose.estimate.cross_validation import AS_GIVEN, Judged, held_out_steps
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fit_set import Tried, fit_set
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.plausibility import does_nothing, fitted_again, implausible, known_together, undetermined
from bns.diagnose.estimate.problem import given_steps, problem_for
from bns.diagnose.estimate.starts import fitting
from bns.diagnose.parallel import one_thread_each
from bns.diagnose.predict.base import Predictor, Steps
from bns.diagnose.predict.jointed import JointedPredictor
from bns.diagnose.predict.paired_errors import PairedErrors, PairedWindows
from bns.errors import ModelError, in_both
from bns.physics.effect import Effect
from bns.physics.effects import effect_in_file
from bns.physics.figures import with_unit
from bns.physics.formula import formula_effect
from bns.physics.jointed.model import JointedModel
from bns.physics.model import ActiveEffect, Model


@dataclass(frozen=True)
class ExtendedModel:
    """The refitted model, the errors of the steps to it, and what to beware of.

    ``errors``: of the model as given, then with each effect in turn, fitted to other trials than those it is judged on.
    """

    fit: Fit
    model: Model
    errors: PairedErrors
    warnings: tuple[str, ...] = ()
    steps: tuple[Steps, ...] = ()
    """What each of the models predicts, as it was judged: as given, then with each effect in turn, fitted to other trials."""

    @property
    def names(self) -> tuple[str, ...]:
        """The steps: "as given", then the effects in the order in which they were added."""
        return tuple(m.name for m in next(iter(self.errors.horizons.values())).models)


@dataclass
class Memory:
    """What earlier calls with the same predictor and model worked out, and these would work out again.

    ``fits`` by what they are of: the model as given, whether clocks are each trial's own, the effects added. ``tried``: what was
    tried on the way to them; None where each call is to try for itself. ``windows``: those that all models are judged on.
    """

    fits: dict[tuple[str, bool, frozenset[Effect]], tuple[Judged, Fit]] = field(default_factory=dict)
    tried: Tried | None = None
    windows: PairedWindows | None = None

    def know(self, model: Model, problem: Problem, fit: Fit, effects: Iterable[Effect]) -> None:
        """The fit of these effects to come is this one, with its numbers and its noise, as a diagnosis shows it already.

        The effects as `fitting` scales them to the tracks. A fit that is begun elsewhere ends in nearly the same numbers, and one
        error would be shown with two values.
        """
        self.fits[model.canonical_json(), False, frozenset(effects)] = Judged("", fit.model, problem.pose_filter), fit


def effect_from(
    text: str, model: Model, term: str | None = None, on: str | None = None, columns: Iterable[str] = ()
) -> tuple[Effect, dict[str, str]]:
    """The effect of a name that the model can lack, of a Python file, or of a formula; and how a model file says so.

    ``columns``: of the log, which a formula may use.
    """
    if term is not None:
        if text in model.catalogue():
            raise ModelError(f"{text} is the name of a listed effect; give the formula another one.")
        return formula_effect(text, term, on or "v", columns), {"term": term, "on": on or "v"}
    if text.endswith(".py"):
        return effect_in_file(Path(text)), {"file": str(Path(text).resolve())}
    return model.effect_named(text), {}


@one_thread_each()
def add_effects(
    predictor: Predictor,
    model: Model,
    effects: Sequence[tuple[Effect, Mapping[str, str]]],
    measured: Measured,
    per_trial: bool = False,
    memory: Memory | None = None,
    told: Callable[[float, str], None] = lambda _share, _text: None,
) -> ExtendedModel:
    """Add effects one after the other, each fitted with all before it; ModelError if the model has one already.

    ``per_trial``: an effect that may differ from trial to trial does. ``memory``: fits of earlier calls with the same predictor;
    those of this one are added. ``told``: the share that is done (0 to 1), and what is being fitted.
    """
    if per_trial and not any(effect.per_trial_allowed for effect, _ in effects):
        able = ", ".join(e.name for e in model.catalogue().values() if e.per_trial_allowed) or "none of this robot"
        given, way = ", ".join(e.name for e, _ in effects), in_both("--per-trial", "per_trial=True")
        raise ModelError(f"None of {given} may differ from trial to trial; {way} goes with {able}.")
    for effect, _ in effects:
        if any(a.effect.name == effect.name for a in model.effects):
            raise ModelError(
                f"The model {model.name} already has {effect.name}; it is fitted again whenever an effect is added."
            )
    effects = [(fitting(effect, model, predictor.tracks), written) for effect, written in effects]
    memory = Memory() if memory is None else memory
    judged, tried = [], memory.tried or Tried()
    for k, (effect, _) in enumerate(effects):  # the k-th fit is of k effects, and takes about k times as long
        told(k * (k + 1) / (len(effects) * (len(effects) + 1)), f"fitting with {effect.name}")
        judged.append(_judged(predictor, model, effects[: k + 1], per_trial, memory, tried))
    steps = (given_steps(predictor, model), *(one.held_out(predictor) for one, _ in judged))
    names = (AS_GIVEN, *(effect.name for effect, _ in effects))
    windows, fit = memory.windows or PairedWindows(predictor), judged[-1][1]
    errors = windows.errors(list(zip(names, steps, strict=True)))
    warnings = (*warnings_on(fit, effects, errors), *fitted_again(model, fit))
    return ExtendedModel(fit, documented(fit, model, measured, errors, predictor), errors, warnings, steps)


def _judged(
    predictor: Predictor,
    model: Model,
    effects: Sequence[tuple[Effect, Mapping[str, str]]],
    per_trial: bool,
    memory: Memory,
    tried: Tried,
) -> tuple[Judged, Fit]:
    """The model with these effects, fitted and predicted on trials held out; from ``memory`` where the set is known there."""
    key = (model.canonical_json(), per_trial, frozenset(effect for effect, _ in effects))
    if key not in memory.fits:
        problem, fit = _step(predictor, model, effects, per_trial, tried)
        steps = held_out_steps(predictor, problem.pose_filter, fit.model)
        memory.fits[key] = Judged("", fit.model, problem.pose_filter, steps), fit
    return memory.fits[key]


def _step(
    predictor: Predictor,
    model: Model,
    effects: Sequence[tuple[Effect, Mapping[str, str]]],
    per_trial: bool,
    tried: Tried,
) -> tuple[Problem, Fit]:
    """The model with these effects, all numbers fitted."""
    problem, fit, _ = fit_set(predictor, model, [effect for effect, _ in effects], tried=tried)
    written = fit.model
    for effect, how in effects:
        written = _written(written, effect.name, how)
        if per_trial and effect.per_trial_allowed:
            written = with_trial_clocks(written, effect.name)
    if not per_trial:
        return problem, replace(fit, model=written)
    problem = problem_for(predictor, written, problem.pose_filter.noise)
    return problem, problem.fit(written)


def warnings_on(fit: Fit, effects: Sequence[tuple[Effect, Mapping[str, str]]], errors: PairedErrors) -> Iterator[str]:
    """What a user should know before using the model: numbers at a bound or beyond belief, effects that do nothing, no gain."""
    named = {effect.name: effect for effect, _ in effects}
    for index, number in enumerate(fit.free):
        p, value = number.parameter, float(fit.values[index])
        if number.effect not in named:
            continue
        if value in {p.low, p.high} and value != p.neutral and value not in p.reached:
            at = f"{p.name} is at its bound, {value:g}{with_unit(p.unit)}"
            yield f"{number.effect}: {at}: the data require more than the model allows."
    for name in sorted(named):
        why = implausible(fit, name, bounds=False)
        if why:
            yield f"{name} fits best with an implausible value: {why}."
        elif unknown := undetermined(fit, name):
            yield f"{name}: {unknown}: each may be anything that is allowed."
        elif known_together(fit, name):
            yield on_numbers(named[name])
        elif does_nothing(fit, name):
            yield f"{name} has no visible effect in these data: its numbers cannot be told from the neutral ones (no effect)."
    if errors.trials < 2:
        yield "there is one trial, and the error is that of the trial to which the numbers were fitted, not of others."
        return
    for before, after in pairwise(next(iter(errors.horizons.values())).models):
        if not errors.between(before.name, after.name):
            yield f"with {after.name}, the error on held-out trials does not fall."


def _written(model: Model, name: str, written: Mapping[str, str]) -> Model:
    return replace(
        model, effects=tuple(replace(a, written=written) if a.effect.name == name else a for a in model.effects)
    )


def documented(
    fit: Fit, before: Model, measured: Measured, errors: PairedErrors | None, predictor: Predictor
) -> Model:
    """The fitted model with intervals, reasons and provenance; errors of None: none are known."""
    reason = f"fitted to {len(measured.tracks)} trials of {measured.called} ({measured.digest})"
    effects = tuple(_with_interval(fit, active, reason) for active in fit.model.effects)
    provenance = {
        "begun_from": before.name,
        "data": measured.called,
        "data_sha256": measured.digest,
        **({"logs": [{"data": name, "data_sha256": digest} for name, digest in measured.files]} if measured.files else {}),
        "date": datetime.now(UTC).strftime("%Y-%m-%d"),
        "trials": len(measured.tracks),
        "held_out_position_error_m": {
            name: {h: round(e.rms_m, 6) for h, e in errors.of(name).items() if np.isfinite(e.rms_m)}
            for name in (m.name for m in next(iter(errors.horizons.values())).models)
        }
        if errors
        else {},
    }
    written = replace(fit.model, effects=effects, provenance=provenance)
    if isinstance(written, JointedModel) and isinstance(predictor, JointedPredictor) and written.limited_by_set_points:
        return written.by_set_points(predictor.told_rad_s)
    return written


def fitted_to(model: Model, digest: str) -> bool:
    """Whether numbers of a model came of the measurements with this digest, as `documented` says where they come from.

    Of several files taken together, those of each one alone do, too.
    """
    return bool(digest) and digest in _digests(model)


def known_to(model: Model, measured: Measured) -> str:
    """The names of the logs among these measurements that numbers of a model came of; "" for none."""
    if fitted_to(model, measured.digest):
        return measured.called
    return ", ".join(name for name, digest in measured.files if fitted_to(model, digest))


def _digests(model: Model) -> set[str]:
    """Of the measurements that a model was fitted to, and of each file of them."""
    logs = model.provenance.get("logs")
    each = [one for one in logs if isinstance(one, dict)] if isinstance(logs, list) else []
    return {str(one["data_sha256"]) for one in (model.provenance, *each) if one.get("data_sha256")}


def _with_interval(fit: Fit, active: ActiveEffect, reason: str) -> ActiveEffect:
    intervals = {f.parameter.name: fit.interval(i) for i, f in enumerate(fit.free) if f.effect == active.effect.name}
    if active.trial_values:
        unit = active.effect.parameters[0].unit
        reason += f"; the mean of one value a trial, {min(active.trial_values):+.3f} to {max(active.trial_values):+.3f} {unit}"
    return replace(active, basis="fitted", reason=reason, intervals=intervals, replaces=None)


def model_yaml(model: Model) -> str:
    """A model as the text of a YAML file that `load_model` reads back."""
    tree: dict[str, Any] = model.written_base()
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
