"""Which effects are missing: forwards while a step earns something on held-out trials, with a look back after each.

Guards: decoys set a threshold, the chance of a false alarm is shared out over the whole catalogue, a number at a bound
or beyond what is plausible is rejected with its reason.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.clocks.trial_clock_test import (
    TrialClocks,
    compare_clocks,
    fit_trial_clocks,
    with_shared_clock,
)
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.lacking import fit_without
from bns.diagnose.estimate.plausibility import believable, half_as_far, limiting
from bns.diagnose.estimate.problem import settled_problem
from bns.diagnose.estimate.significance import MIN_Z
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.base import Predictor
from bns.diagnose.select.acceptance import Acceptance
from bns.diagnose.select.exchanges import Entry, Exchanges
from bns.diagnose.select.extending import fits_better, reduced
from bns.diagnose.select.forwards import Forwards, accepted_with
from bns.diagnose.select.indistinguishable import indistinguishable
from bns.diagnose.select.look_back import LookBack
from bns.diagnose.select.negligible import negligibly_worse
from bns.diagnose.select.result import Candidate, SelectionResult, SelectionStep, predicts_better
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect
from bns.physics.model import Model

FALSE_ALARM = DEFAULTS.select.false_alarm
MIN_Z_STRETCHES = DEFAULTS.estimate.min_z_stretches
MIN_GAIN = DEFAULTS.select.min_gain
CLOCKS_CHANCE = DEFAULTS.select.clocks_chance
MOST = DEFAULTS.select.most_effects


def least_z(predictor: Predictor) -> float:
    """By how many standard errors an effect must gain to be taken: of wheels, and of a body that is simulated itself."""
    return MIN_Z if predictor.luck is None else MIN_Z_STRETCHES


@dataclass(frozen=True)
class _Round:
    """Where a search stood before a round, with what the round needs to come out the same again."""

    model: Model
    problem: Problem
    fit: Fit
    accepted: tuple[str, ...] = ()
    steps: tuple[SelectionStep, ...] = ()
    tried: frozenset[frozenset[str]] = frozenset()
    entry: Entry | None = None


class StepwiseSelection:
    """A search for the effects that ``model`` lacks, on the tracks of a predictor.

    ``own_clocks``: may each trial have a clock of its own? ``curve_does_better``: asked of a problem, the fit before and the fit
    with one more effect: does a curve of any form predict better for certain than that effect? ``begun``: a search for the same
    on the same tracks; where it searched without clocks of the trials first, that is not done again.
    """

    def __init__(
        self,
        predictor: Predictor,
        model: Model,
        extra: Mapping[str, Effect] | None = None,
        tick: Callable[[str], None] = lambda _: None,
        barred: Collection[str] = (),
        alone: Callable[[Candidate], None] = lambda _: None,
        own_clocks: bool = True,
        curve_does_better: Callable[[Problem, Fit, Fit], bool] = lambda _problem, _fit, _added: False,
        begun: StepwiseSelection | None = None,
    ) -> None:
        self.predictor, self.model = predictor, model.arranged()
        self._barred, self._own_clocks = barred, own_clocks
        self.catalogue = listed(self.model, extra, predictor.tracks, barred)
        self._worth = dict(self.catalogue) if predictor.screening is None else {}
        self.level = FALSE_ALARM / max(len(self.catalogue), 1)
        self._acceptance = Acceptance(self.catalogue, self.level, least_z(predictor))
        self._exchanges = Exchanges(predictor, self.catalogue, self._worth, tick)
        shared = self.catalogue, self._worth, self._exchanges, self._acceptance, tick
        self._look_back = LookBack(predictor, *shared)
        self._forwards = Forwards(predictor, self.model, *shared, alone, curve_does_better)
        self._plain: SelectionResult | None = begun._plain if begun is not None else None
        """Where the search without clocks of the trials ended; with implausible numbers allowed it is another."""
        self._doubted: _Round | None = None
        """The first round of the last search in which a number was not believed, or its last round."""

    def run(self, before: SelectionResult | None = None) -> SelectionResult:
        """The search; again with implausible numbers allowed where one was passed over, if that predicts better for certain.

        ``before``: the end of a search on nearly the same tracks, which is the end of this one too if it `stands` here.
        """
        result = self._run(before)
        if not any(step.passed_over for step in result.steps):
            return result
        believed, self._acceptance.all_believed = result, True
        self._exchanges.forget()
        bold = self._run()
        self._acceptance.all_believed = False
        return bold if bold.accepted and predicts_better(believed, bold) else believed

    def _run(self, before: SelectionResult | None = None) -> SelectionResult:
        """The search; again with a clock for each trial where these differ, since that hides what else is wrong."""
        if before:
            plain = self.stands(before) or self._select()
        elif self._acceptance.all_believed:
            plain = self._select()
        else:
            plain = self._plain = self._plain or self._select()
        clocks = fit_trial_clocks(plain.problem, plain.fit) if self._own_clocks else None
        if clocks is None or _per_trial_effect(clocks.fit.model) in self._barred:
            return plain
        if not self._clocks_earned(clocks, plain.fit):
            return plain
        given = self.model
        self.model = self._forwards.given = self._bare_with_clocks(clocks.fit.model, given)
        added = self.catalogue.pop(_per_trial_effect(self.model), None)
        self._worth.pop(_per_trial_effect(self.model), None)
        self._exchanges.forget()
        result = self._select()
        still = compare_clocks(result.problem, result.problem.fit(with_shared_clock(result.fit.model)), result.fit)
        if still is None or not self._clocks_earned(still, result.fit):
            return plain
        return self._with_clocks(result, result.problem.fit(given), clocks, added)

    @staticmethod
    def _bare_with_clocks(fitted: Model, given: Model) -> Model:
        """The model as given and the trials' clocks, without what the first search added."""
        kept = {active.effect.name for active in given.effects} | {_per_trial_effect(fitted)}
        for active in fitted.effects:
            fitted = fitted if active.effect.name in kept else fitted.without(active.effect.name)
        return fitted

    def _clocks_earned(self, clocks: TrialClocks, before: Fit) -> bool:
        """Few trials may earn all of it, so no number of standard errors is asked for: the clocks of most may be right."""
        e = clocks.paired_comparison
        return e.p_value < CLOCKS_CHANCE and e.elpd_diff > MIN_GAIN * float(before.held_out.mean())

    def _with_clocks(
        self, result: SelectionResult, nominal: Fit, clocks: TrialClocks, added: Effect | None
    ) -> SelectionResult:
        """The search's end with the clocks named first, where the model given had none."""
        name = _per_trial_effect(self.model)
        candidate = Candidate(name, clocks.fit, clocks.paired_comparison)
        first = replace(result.steps[0], ranking=(candidate, *result.steps[0].ranking))
        names = (name,) if added else ()
        return replace(
            result,
            nominal=nominal,
            accepted=(*names, *result.accepted),
            steps=(first, *result.steps[1:]),
            competing_models=tuple((*names, *r) for r in result.competing_models),
        )

    def _select(self) -> SelectionResult:
        """Forwards and back until nothing more is earned; then competing models of the same size.

        A search that believes all numbers goes on where the one before it first did not believe one.
        """
        now, self._doubted = self._beginning(), None
        problem, fit, accepted, steps, tried = now.problem, now.fit, now.accepted, now.steps, now.tried
        while True:
            now = _Round(self.model, problem, fit, accepted, steps, tried, self._exchanges.entry)
            there, doubts = accepted, self._acceptance.doubts
            if len(accepted) < MOST:
                step, problem, fit = self._forwards.next_step(problem, fit, accepted)
                steps = (*steps, step.slim())  # sixty fits, each as large as the log
                if step.selected:
                    self._exchanges.entry = Entry(now.problem, now.fit, accepted, steps[-1])
                    accepted = accepted_with(accepted, step, fit)
                    problem, fit, accepted = self._look_back.exchange_step(problem, fit, accepted)
                    problem, fit, accepted = self._look_back.backward_step(problem, fit, accepted)
            if accepted == there:
                problem, fit, accepted = self._look_back.merge_step(problem, fit, accepted)
            ends = accepted == there or frozenset(accepted) in tried
            if self._doubted is None and (ends or self._acceptance.doubts > doubts):
                self._doubted = now
            if ends:
                break
            tried |= {frozenset(accepted)}
        return self._ended(problem, fit, accepted, steps)

    def _beginning(self) -> _Round:
        """The model as it is given; where all numbers are believed, the first round in which that decides something."""
        if self._acceptance.all_believed and self._doubted is not None and self._doubted.model is self.model:
            self._exchanges.entry = self._doubted.entry
            return self._doubted
        problem, nominal = self._refit_with_noise(self.model)
        if nominal.free:
            problem, nominal = self._refit_with_noise(nominal.model, problem.pose_filter.noise)
        return _Round(self.model, problem, nominal)

    def competing(self, found: SelectionResult, alike: bool = False) -> SelectionResult:
        """The result of this search with fewer effects than it ended with, and the explanations that compete with what is left.

        Those of the search competed with all of its effects. Trials with clocks of their own are not asked. ``alike``: only those
        whose likelihood is the same (to `variant_evidence`): where terms describe a part of the motion, and are not fitted again
        with each effect, trials differ by more than the effects do, and anything would compete.
        """
        if not found.accepted or found.competing_models or found.fit.model.per_trial_effect is not None:
            return found
        self._exchanges.forget()
        self._exchanges.entry = None
        models = self._competing_models(found.problem, found.fit, found.accepted)
        models = [one for one in models if not alike or not (fits_better(found.fit, one[1]) or fits_better(one[1], found.fit))]
        return replace(found, competing_models=tuple(names for names, _ in models))

    def stands(self, before: SelectionResult) -> SelectionResult | None:
        """The end of another search as the end of this one, if it is one here as well; else None.

        It is where no effect comes in, none goes and none is exchanged, the conditions on which `_select` ends.
        """
        accepted, model = before.accepted, before.fit.model
        if not accepted or model.per_trial_effect is not None or any(step.passed_over for step in before.steps):
            return None
        problem, fit = self._refit_with_noise(model, before.problem.pose_filter.noise)
        if any(self._acceptance.rejected(fit, name, bounds=False) for name in accepted):
            return None
        simpler = {name: reduced(self.catalogue, problem, fit, name) for name in accepted}
        if not all(self._acceptance.stays(problem, one, fit, name) for name, one in simpler.items()):
            return None
        if self._look_back.exchange_step(problem, fit, accepted)[2] != accepted:
            return None
        step = self._forwards.next_step(problem, fit, accepted)[0] if len(accepted) < MOST else before.steps[-1]
        return None if step.selected else self._ended(problem, fit, accepted, [*before.steps[:-1], step.slim()])

    def _ended(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...], steps: Sequence[SelectionStep]
    ) -> SelectionResult:
        competing_models = self._competing_models(problem, fit, accepted)
        simplest = min(competing_models, key=lambda r: len(r[1].free), default=None)
        if simplest is not None and len(simplest[1].free) < len(fit.free):
            competing_models = [(accepted, fit), *(r for r in competing_models if r is not simplest)]
            accepted, fit = simplest
        names = tuple(names for names, _ in competing_models)
        return SelectionResult(problem, problem.fit(self.model), fit, accepted, tuple(steps), names)

    def _refit_with_noise(self, model: Model, start: Array | None = None) -> tuple[Problem, Fit]:
        """Noise and numbers that belong together."""
        return settled_problem(self.predictor, model, start)

    def _competing_models(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> list[tuple[tuple[str, ...], Fit]]:
        """Explanations of the same size, one effect exchanged, which these tracks, or errors, cannot tell from it.

        What comes in must have earned its place: where trials disagree, much that earns nothing certain is no worse for certain.
        Nor may one with more numbers have one that may be anything: a warm-up of any length at all is a gain; a cable that is as
        far away as any competes if one half as far away does. Where a number is outside of what is plausible, it is the best
        plausible one that competes: a motor that never cools is a battery that sags.
        """
        competing_models: list[tuple[tuple[str, ...], Fit]] = []
        lacking = cache(partial(fit_without, problem, fit))
        for name, other, found in self._exchanges.of(problem, fit, accepted):
            tried = found
            if len(found.free) > len(fit.free) and limiting(found, other):
                nearer = half_as_far(found, other)
                if nearer is None:
                    continue
                tried = problem.fit(nearer)
            # at a bound it may be: a tether from ever farther away is a slope
            may = not self._acceptance.rejected(tried, other, bounds=False) and self._acceptance.earned_over(
                problem, lacking(name), tried, other
            )
            model = believable(tried, other) if may else None
            rival = tried if model is None else problem.fit(model)
            if may and (indistinguishable(rival, fit, lacking(name)) or negligibly_worse(problem, rival, fit, lacking(name))):
                competing_models.append((tuple(other if a == name else a for a in accepted), tried))
        return competing_models


def _per_trial_effect(model: Model) -> str:
    return model.per_trial_effect.effect.name if model.per_trial_effect else ""
