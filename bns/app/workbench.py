"""A log and a model on the bench: effects switched on and off, numbers moved, the errors of all on the same windows.

Every number comes from the functions behind `bns.add` and `bns.compare`; what was worked out once is kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from bns.api.add import AddResult, added
from bns.api.common.prepared import Prepared, PreparedNetworks, prepared, prepared_networks
from bns.api.measurements import Log
from bns.api.model import Given, Model
from bns.app.switches import Switches, Term
from bns.diagnose.adding import Memory
from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.cross_validation import AS_GIVEN
from bns.diagnose.estimate.fit_set import Tried
from bns.diagnose.estimate.plausibility import does_nothing, implausible
from bns.diagnose.estimate.problem import given_steps
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.base import Steps
from bns.diagnose.predict.horizons import laid_paths
from bns.diagnose.predict.paired_errors import PairedErrors, PairedWindows, judged_windows
from bns.diagnose.values import numbers_of
from bns.errors import ModelError
from bns.physics.effect import Effect
from bns.physics.formula import formula_effect
from bns.physics.jointed.model import JointedModel

BY_HAND = "by hand"
"""The name of a model whose numbers were moved, in the list of errors: it is judged as it is, nothing is fitted."""


@dataclass(frozen=True)
class Shown:
    """What the page shows of one state of the switches.

    ``model``: with the effects, fitted, or its numbers moved by hand; ``steps``: what the models of the list of errors predict,
    as they were judged: as given, with each effect in turn, by hand; ``numbers``: {effect: {parameter: {value, low, high, …}}}
    as `bns add --json` has them; ``badges``: effect -> what to beware of.
    """

    switches: Switches
    model: Model
    errors: PairedErrors
    steps: tuple[Steps, ...]
    numbers: Mapping[str, Mapping[str, Mapping[str, Any]]]
    badges: Mapping[str, tuple[str, ...]]
    warnings: tuple[str, ...]

    @property
    def names(self) -> list[str]:
        """Of the models in the list of errors."""
        return [m.name for m in next(iter(self.errors.horizons.values())).models]


class Workbench:
    """One log, one model as given: with effects, or networks, which have none. As `bns.add`: DataError, ModelError."""

    def __init__(self, log: Log, model: Given) -> None:
        self.ready: Prepared | PreparedNetworks = prepared_networks(log, model) or prepared(log, model)
        self.given = model
        predictor = self.ready.predictor
        timed = None if predictor.tracks.timed or self.of_networks else predictor.tracks  # no clock where nothing has a time
        self.catalogue: dict[str, Effect] = {} if self.of_networks else listed(self.ready.model, None, timed)
        # a body is simulated near the models asked for last: what was tried from another place may read otherwise
        self._memory = Memory(tried=Tried() if self.on_wheels else None)
        self._fitted: dict[Any, Shown] = {}
        self._formulas: dict[Any, Effect] = {}

    @property
    def of_networks(self) -> bool:
        """Are these networks, which can be compared and have no effects?"""
        return isinstance(self.ready, PreparedNetworks)

    @property
    def on_wheels(self) -> bool:
        """Is the model a drive?"""
        return not self.of_networks and not isinstance(self.ready.model, JointedModel)

    @property
    def thinned(self) -> str:
        """How many of the poses are used, in words; "" for all."""
        if isinstance(self.ready, PreparedNetworks):
            return ""
        return " ".join(filter(None, (self.ready.thinned, self.ready.fitted_here)))

    @property
    def horizons(self) -> tuple[str, ...]:
        """Those that these tracks have windows of."""
        predictor = self.ready.predictor
        return tuple(h for h in predictor.horizons if len(predictor.windows(h)[0]))

    @property
    def _windows(self) -> PairedWindows:
        if self._memory.windows is None:
            self._memory.windows = PairedWindows(self.ready.predictor)
        return self._memory.windows

    @cached_property
    def as_given(self) -> Shown:
        """The model as it was handed in."""
        predictor, model = self.ready.predictor, self.ready.model
        steps = given_steps(predictor, model)
        errors = self._windows.errors([(AS_GIVEN, steps)])
        return Shown(Switches(), model, errors, (steps,), {}, {}, ())

    def shown(self, switches: Switches) -> Shown:
        """A state of the switches: what is on is fitted, unless it was before; numbers moved by hand are taken as they are."""
        fitted = self.fitted(switches)
        return self.by_hand(fitted, switches) if switches.by_hand else fitted

    def fitted(self, switches: Switches) -> Shown:
        """With every number fitted; the list of errors is that of `bns add` with the same effects."""
        key = switches.on, switches.terms
        if not switches.on:
            return replace(self.as_given, switches=switches.fitted())
        if key not in self._fitted:
            self._fitted[key] = self._fit(switches.fitted())
        return self._fitted[key]

    def _fit(self, switches: Switches) -> Shown:
        result = self.add(switches)
        made, badges = result.extended, {name: _badges(result, name) for name in switches.on}
        numbers = numbers_of(made.fit)
        return Shown(switches, result.model, made.errors, made.steps, numbers, badges, result.warnings)

    def add(self, switches: Switches) -> AddResult:
        """What `bns.add` gives for the effects that are on."""
        if isinstance(self.ready, PreparedNetworks):
            raise ModelError(f"{self.ready.model.name} holds networks, which have no effects: they can be compared only.")
        chosen = [self.effect(switches, name) for name in switches.on]
        return added(self.ready, chosen, memory=self._memory)

    def by_hand(self, fitted: Shown, switches: Switches) -> Shown:
        """With numbers of the user's: what the model predicts as it is, judged on the same windows as all before it."""
        values = {a.effect.name: dict(a.by_name) for a in fitted.model.effects}
        for (effect, parameter), value in switches.by_hand:
            values[effect][parameter] = value
        model = _guessed(Model(fitted.model.with_values(values)), {effect for (effect, _), _ in switches.by_hand})
        predictor = self.ready.predictor
        steps = (*fitted.steps, predictor.steps(model))
        errors = self._windows.errors(list(zip([*fitted.names, BY_HAND], steps, strict=True)))
        return replace(fitted, switches=switches, model=model, errors=errors, steps=steps)

    @property
    def columns(self) -> tuple[str, ...]:
        """The log's further columns, which a formula may use."""
        return tuple(getattr(self.ready.predictor.tracks, "extra", ()))

    def effect(self, switches: Switches, name: str) -> tuple[Effect, Mapping[str, str]]:
        """A listed effect or a formula, and how a model file writes it. The same object each time: fits are known by it."""
        for term in switches.terms:
            if term.name == name:
                return self.term(term), {"term": term.term, "on": term.on}
        return self.catalogue[name], {}

    def term(self, term: Term) -> Effect:
        """A formula as an effect; the same object each time."""
        if term not in self._formulas:
            self._formulas[term] = formula_effect(term.name, term.term, term.on, self.columns)
        return self._formulas[term]

    def path(self, steps: Steps, trial: int) -> Array:
        """Predicted poses (frames, 3) of a trial, from its first measured one."""
        tracks = self.ready.predictor.tracks
        return laid_paths(tracks, steps)[tracks.first[trial] : tracks.first[trial + 1]]

    def measured(self, trial: int) -> tuple[Array, Array]:
        """Times (frames,) and poses (frames, 3) of a trial."""
        tracks = self.ready.predictor.tracks
        rows = slice(tracks.first[trial], tracks.first[trial + 1])
        return tracks.own_s[rows], tracks.pose[rows]

    def windows(self, steps: Steps, horizon: str) -> pd.DataFrame:
        """The judged windows, a row each: trial, number (of the trial), t_s (of its end), x_m, y_m (measured there), error_mm,
        heading_deg, and every variable at its start."""
        predictor, tracks = self.ready.predictor, self.ready.predictor.tracks
        errors = judged_windows(predictor, steps, horizon)
        return pd.DataFrame(
            {
                "trial": np.array(tracks.names, dtype=object)[errors.trial],
                "number": errors.trial,
                "from_s": tracks.own_s[errors.start],
                "t_s": tracks.own_s[errors.end],
                "x_m": tracks.pose[errors.end, 0],
                "y_m": tracks.pose[errors.end, 1],
                "error_mm": 1e3 * errors.position_m,
                "heading_deg": np.degrees(errors.heading_rad),
                **predictor.at_frames(errors.start),
            }
        )


def _badges(result: AddResult, name: str) -> tuple[str, ...]:
    """In the words of `bns add`'s warnings."""
    fit = result.extended.fit
    why = implausible(fit, name, bounds=False)
    if why:
        return (f"implausible: {why}",)
    if does_nothing(fit, name):
        return ("has no visible effect in these data",)
    numbers = [(f.parameter, float(v)) for f, v in zip(fit.free, fit.values, strict=True) if f.effect == name]
    return tuple(f"{p.name} is at its bound" for p, v in numbers if v in {p.low, p.high} and v != p.neutral)


def _guessed(model: Model, moved: set[str]) -> Model:
    """The model with the effects whose numbers were moved by hand marked as guesses, without the intervals of the fit."""
    reason = "set by hand in bns explore"
    effects = tuple(
        replace(a, basis="guess", reason=reason, intervals={}) if a.effect.name in moved else a for a in model.effects
    )
    return Model(model, effects=effects)
