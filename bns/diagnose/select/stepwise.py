"""Which effects are missing: forwards while a step earns something on held-out trials, with a look back after each.

Guards: decoys set a threshold, the chance of a false alarm is shared out over the whole catalogue, a number at a bound
or beyond what is plausible is rejected with its reason.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import combinations

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.clocks.trial_clock_test import (
    TrialClocks,
    compare_clocks,
    fit_trial_clocks,
    with_shared_clock,
)
from bns.diagnose.estimate.fit import Fit, Problem
from bns.diagnose.estimate.lacking import fit_without
from bns.diagnose.estimate.plausibility import at_bound, believable, implausible, limiting, undetermined
from bns.diagnose.estimate.problem import settled_problem
from bns.diagnose.estimate.significance import MIN_Z
from bns.diagnose.estimate.starts import fit_extended, fit_with, listed
from bns.diagnose.parallel import each
from bns.diagnose.predict.base import Predictor
from bns.diagnose.select.exchanges import Entry, Exchanges
from bns.diagnose.select.extending import extended, fits_better, reduced, shorter, simple, to_extend, variant
from bns.diagnose.select.indistinguishable import indistinguishable
from bns.diagnose.select.negligible import certainly_better
from bns.diagnose.select.result import Candidate, SelectionResult, SelectionStep, predicts_better
from bns.diagnose.select.screening import screened, worth_a_fit
from bns.diagnose.settings import DEFAULTS
from bns.physics.decoys import DECOYS
from bns.physics.effect import Effect
from bns.physics.model import Model

FALSE_ALARM = DEFAULTS.select.false_alarm
MIN_Z_STRETCHES = DEFAULTS.estimate.min_z_stretches
MIN_GAIN = DEFAULTS.select.min_gain
BEHIND = DEFAULTS.select.behind
CLOCKS_CHANCE = DEFAULTS.select.clocks_chance
MOST = DEFAULTS.select.most_effects
SIMPLE_FIRST = DEFAULTS.select.simple_first
CURVE_FROM = DEFAULTS.select.curve_from


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
        self.predictor, self.model, self.tick, self.alone = predictor, model.arranged(), tick, alone
        self._barred, self._own_clocks, self._curve_does_better = barred, own_clocks, curve_does_better
        self.catalogue = listed(self.model, extra, predictor.tracks, barred)
        self._worth = dict(self.catalogue) if predictor.screening is None else {}
        self._exchanges = Exchanges(predictor, self.catalogue, self._worth, tick)
        self._all_believed = False
        self._plain: SelectionResult | None = begun._plain if begun is not None else None
        """Where the search without clocks of the trials ended; with implausible numbers allowed it is another."""
        self._least_z = MIN_Z if predictor.luck is None else MIN_Z_STRETCHES
        self.level = FALSE_ALARM / max(len(self.catalogue), 1)

    def run(self, before: SelectionResult | None = None) -> SelectionResult:
        """The search; again with implausible numbers allowed where one was passed over, if that predicts better for certain.

        ``before``: the end of a search on nearly the same tracks, which is the end of this one too if it `stands` here.
        """
        result = self._run(before)
        if not any(step.passed_over for step in result.steps):
            return result
        believed, self._all_believed = result, True
        self._exchanges.forget()
        bold = self._run()
        self._all_believed = False
        return bold if bold.accepted and predicts_better(believed, bold) else believed

    def _run(self, before: SelectionResult | None = None) -> SelectionResult:
        """The search; again with a clock for each trial where these differ, since that hides what else is wrong."""
        if before:
            plain = self.stands(before) or self._select()
        elif self._all_believed:
            plain = self._select()
        else:
            plain = self._plain = self._plain or self._select()
        clocks = fit_trial_clocks(plain.problem, plain.fit) if self._own_clocks else None
        if clocks is None or _per_trial_effect(clocks.fit.model) in self._barred:
            return plain
        if not self._clocks_earned(clocks, plain.fit):
            return plain
        given = self.model
        self.model = self._bare_with_clocks(clocks.fit.model, given)
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
        """Forwards and back until nothing more is earned; then competing models of the same size."""
        problem, nominal = self._refit_with_noise(self.model)
        if nominal.free:
            problem, nominal = self._refit_with_noise(nominal.model, problem.pose_filter.noise)
        fit = nominal
        accepted: tuple[str, ...] = ()
        steps: list[SelectionStep] = []
        tried: set[frozenset[str]] = set()
        while True:
            there = accepted
            if len(accepted) < MOST:
                before = problem, fit
                step, problem, fit = self._next_step(problem, fit, accepted)
                steps = [*(earlier.slim() for earlier in steps), step]  # sixty fits, each as large as the log
                if step.selected:
                    self._exchanges.entry = Entry(*before, accepted, step)
                    accepted = (*(a for a in accepted if a != step.instead_of), step.selected)
                    problem, fit, accepted = self._exchange_step(problem, fit, accepted)
                    problem, fit, accepted = self._backward_step(problem, fit, accepted)
            if accepted == there:
                problem, fit, accepted = self._merge_step(problem, fit, accepted)
            if accepted == there or frozenset(accepted) in tried:
                break
            tried.add(frozenset(accepted))
        return self._ended(problem, fit, accepted, steps)

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
        if any(self._rejected(fit, name, bounds=False) for name in accepted):
            return None
        simpler = {name: reduced(self.catalogue, problem, fit, name) for name in accepted}
        if not all(self._stays(problem, one, fit, name) for name, one in simpler.items()):
            return None
        if self._exchange_step(problem, fit, accepted)[2] != accepted:
            return None
        step = self._next_step(problem, fit, accepted)[0] if len(accepted) < MOST else before.steps[-1]
        return None if step.selected else self._ended(problem, fit, accepted, [*before.steps[:-1], step])

    def _ended(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...], steps: Sequence[SelectionStep]
    ) -> SelectionResult:
        competing_models = self._competing_models(problem, fit, accepted)
        simplest = min(competing_models, key=lambda r: len(r[1].free), default=None)
        if simplest is not None and len(simplest[1].free) < len(fit.free):
            competing_models = [(accepted, fit), *(r for r in competing_models if r is not simplest)]
            accepted, fit = simplest
        rounds = (*steps[:-1], *(last.slim() for last in steps[-1:]))
        return SelectionResult(
            problem, problem.fit(self.model), fit, accepted, rounds, tuple(names for names, _ in competing_models)
        )

    def _refit_with_noise(self, model: Model, start: Array | None = None) -> tuple[Problem, Fit]:
        """Noise and numbers that belong together."""
        return settled_problem(self.predictor, model, start)

    def _next_step(self, problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> tuple[SelectionStep, Problem, Fit]:
        """A step forwards; none beside several effects where a curve does better than it, and than all that could follow it.

        The list lacks what is missing then. Of several effects the next one alone may do less than a curve.
        """
        forwards = self._forward_step(problem, fit, accepted)
        step = forwards[0]
        if not step.selected or len(accepted) < CURVE_FROM:
            return forwards
        added = next(c.fit for c in step.ranking if c.name == step.selected)
        if not self._curve_does_better(problem, fit, added):
            return forwards
        there = (*(name for name in accepted if name != step.instead_of), step.selected)
        ahead = problem.fit(self._looked_ahead(*forwards[1:], there))
        if not self._curve_does_better(problem, fit, ahead):
            return forwards
        return replace(step, selected="", instead_of=""), problem, fit

    def _looked_ahead(self, problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> Model:
        """With as many effects as a search accepts, one after the other; none is exchanged, and none extends another."""
        while len(accepted) < MOST:
            tried, decoy_threshold = self._with_decoys(problem, fit, self._worth_a_fit(problem, fit, accepted), {})
            step, problem, fit = self._chosen(problem, fit, tried, decoy_threshold, {}, 0)
            if not step.selected:
                break
            accepted = (*accepted, step.selected)
        return fit.model

    def _forward_step(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> tuple[SelectionStep, Problem, Fit]:
        """The best candidate that earns its place and is believed once noise and numbers have settled; what it ends in.

        Where there is none, the best of those that extend an effect which does nothing by itself here.
        """
        left = self._worth_a_fit(problem, fit, accepted)
        place = to_extend(self._worth.values(), fit, accepted, lambda: self._exchanges.of(problem, fit, accepted))
        tried, decoy_threshold = self._with_decoys(problem, fit, [*left, *(self._worth[name] for name in place)], place)
        of = len(self.catalogue) - len(accepted) if self.predictor.screening is not None else 0
        chosen = self._chosen(problem, fit, tried, decoy_threshold, place, of)
        lone = [effect for effect in self._worth.values() if effect.extends and effect.name not in (*accepted, *place)]
        if chosen[0].selected or not lone:
            return chosen
        first, tried = chosen[0], each(partial(self._tried, problem, fit, {}), lone)
        step, problem, fit = self._chosen(problem, fit, tried, decoy_threshold, {}, of)
        ranking = sorted((*first.ranking, *step.ranking), key=lambda c: -c.paired_comparison.elpd_diff)
        passed_over = step.passed_over or first.passed_over
        return replace(step, ranking=tuple(ranking), passed_over=passed_over), problem, fit

    def _with_decoys(
        self, problem: Problem, fit: Fit, effects: Sequence[Effect], place: Mapping[str, tuple[str, Fit]]
    ) -> tuple[list[Candidate], float]:
        """The effects as candidates, and what the best of the decoys gains."""
        tried = each(partial(self._tried, problem, fit, place), [*DECOYS, *effects])
        return tried[len(DECOYS) :], max(c.paired_comparison.elpd_diff for c in tried[: len(DECOYS)])

    def _chosen(
        self,
        problem: Problem,
        fit: Fit,
        tried: Sequence[Candidate],
        decoy_threshold: float,
        place: Mapping[str, tuple[str, Fit]],
        of: int,
    ) -> tuple[SelectionStep, Problem, Fit]:
        """The best candidate that earns its place; one that takes another's (``place``) must lower the error, too.

        So must all that gain less than such a one that lowers none: they would only do a part of what it does.
        """
        if self.predictor.screening is not None:
            tried = self._worked_out(problem, fit, tried)
        ranking = sorted(tried, key=lambda c: -c.paired_comparison.elpd_diff)
        passed_over: list[Candidate] = []
        none_lower = False
        for index, candidate in enumerate(ranking):
            moved = candidate.name in place and variant(self.catalogue, candidate.name)
            if not (fits_better(fit, candidate.fit) if moved else self._earned(candidate, fit, decoy_threshold)):
                continue
            if self._waits(candidate, place, ranking, fit, decoy_threshold):
                continue
            if candidate.rejected_because:
                passed_over += [candidate] if implausible(candidate.fit, candidate.name, bounds=False) else []
                continue
            settled = self._refit_with_noise(candidate.fit.model, problem.pose_filter.noise)
            gone = place.get(candidate.name, ("",))[0]
            lower = moved or not (gone or none_lower) or certainly_better((problem, fit), settled)
            if not lower or (gone and not moved and not self._needed(*settled, candidate.name)):
                none_lower |= not lower
                continue
            rejected_because = self._rejected(settled[1], candidate.name, bounds=False)
            if not rejected_because:
                better = next((p.name for p in passed_over if not indistinguishable(candidate.fit, p.fit, fit)), "")
                return SelectionStep(tuple(ranking), decoy_threshold, candidate.name, better, of, gone), *settled
            ranking[index] = replace(candidate, rejected_because=rejected_because)
            passed_over.append(ranking[index])
        best = passed_over[0].name if passed_over else ""
        return SelectionStep(tuple(ranking), decoy_threshold, "", best, of), problem, fit

    def _waits(
        self,
        candidate: Candidate,
        place: Mapping[str, tuple[str, Fit]],
        ranking: Sequence[Candidate],
        before: Fit,
        decoy_threshold: float,
    ) -> bool:
        """Whether what takes another's place gives way to a simpler one, which it extends, beside that other.

        Friction in the gears is a lag and a friction. Where a friction was accepted, the lag alone comes first if it gains nearly
        as much: the friction beside it may still prove to be of one wheel, or of a cold robot.
        """
        gone, parts = place.get(candidate.name, ("",))[0], extended(self.catalogue, candidate.name)
        if not gone or gone in {*parts, *self.catalogue[candidate.name].contains}:
            return False
        least = SIMPLE_FIRST * candidate.paired_comparison.elpd_diff
        simpler = (c for c in ranking if c.name in parts and c.name not in place and not c.rejected_because)
        return any(c.paired_comparison.elpd_diff >= least and self._earned(c, before, decoy_threshold) for c in simpler)

    def _worth_a_fit(self, problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> list[Effect]:
        """What is fitted beside the accepted effects: where fits are costly, all that the screening ever found promising."""
        if self.predictor.screening is not None:
            self.tick("screening")
            left = [effect for name, effect in self.catalogue.items() if name not in accepted]
            self._worth |= {effect.name: effect for effect in worth_a_fit(screened(problem, fit, left))}
        return simple(self.catalogue, self._worth.values(), accepted)

    def _worked_out(self, problem: Problem, fit: Fit, tried: Sequence[Candidate]) -> list[Candidate]:
        """Where models are worked out roughly: those that come near the best one worked out well, each at its own numbers.

        The curves between which a rough answer is read are of uneven quality, and only like can be compared with like.
        """
        best = max((fit.loss - c.fit.loss for c in tried), default=0.0)
        out = []
        for candidate in tried:
            if fit.loss - candidate.fit.loss >= BEHIND * best > 0 and self.predictor.anchor(candidate.fit.model):
                again = Problem(self.predictor, problem.pose_filter, self.predictor.counted)
                out.append(self._candidate(again, fit, again.fit(candidate.fit.model), candidate.name))
            else:
                out.append(candidate)
        return out

    def _candidate(self, problem: Problem, fit: Fit, added: Fit, name: str) -> Candidate:
        return Candidate(name, added, problem.paired_comparison(fit, added), self._rejected(added, name))

    def _rejected(self, fit: Fit, name: str, bounds: bool = True) -> str:
        """Why an effect may not be taken; where all numbers are believed, only for one at a bound or not determined."""
        why = implausible(fit, name, bounds)
        believed = self._all_believed and not at_bound(fit, name)
        return undetermined(fit, name) or ("" if believed else why)

    def _tried(self, problem: Problem, fit: Fit, place: Mapping[str, tuple[str, Fit]], effect: Effect) -> Candidate:
        self.tick(effect.name)
        extends = place.get(effect.name)
        known = self._exchanges.fitted(problem, fit, extends[0], effect.name) if extends else None
        if known is not None:
            added = known
        elif extends:
            given = any(active.effect.name == extends[0] for active in self.model.effects)
            added = fit_extended(problem, extends[1], effect, given)
        else:
            added = fit_with(problem, fit, effect)
        found = self._candidate(problem, fit, added, effect.name)
        given_alone = {a.effect.name for a in fit.model.effects} <= {a.effect.name for a in self.model.effects}
        if given_alone and effect.name in self.catalogue:
            self.alone(found)
        return found

    def _earned(self, candidate: Candidate, before: Fit, decoy_threshold: float) -> bool:
        e = candidate.paired_comparison
        least = MIN_GAIN * float(before.held_out.mean())
        return e.p_value < self.level and e.z > self._least_z and e.elpd_diff > max(decoy_threshold, least)

    def _exchange_step(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> tuple[Problem, Fit, tuple[str, ...]]:
        """Exchange an accepted effect for one that has earned its place too, while that makes the held-out loss smaller."""
        barred: set[str] = set()
        for _ in range(len(accepted)):
            best, new, comes = fit, accepted, ""
            same = self._exchanges.of(problem, fit, accepted) if len(accepted) > 1 else []
            for name, other, tried in [*same, *self._exchanges.longer(problem, fit, accepted)]:
                better = other not in barred and tried.held_out.sum() < best.held_out.sum() - 0.5
                if better and self._may_stay(problem, tried, other) and self._better_than_part(problem, tried, other):
                    best, new, comes = tried, tuple(other if a == name else a for a in accepted), other
            if new == accepted:
                break
            exchanged, settled = self._refit_with_noise(best.model, problem.pose_filter.noise)
            if any(self._rejected(settled, name, bounds=False) for name in new):  # under its own noise it asks for more
                barred.add(comes)
            else:
                problem, fit, accepted = exchanged, settled, new
        return problem, fit, accepted

    def _merge_step(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> tuple[Problem, Fit, tuple[str, ...]]:
        """One effect in the place of two that both look like it, if it predicts trials held out better.

        A short lag is, to one half, a late clock, and to the other a limit of the acceleration. A search that took the one has a
        use for the other next, and no exchange of one effect leads from there to the lag. Not asked of bodies, whose fits take
        minutes.
        """
        best, new = fit, accepted
        for pair in combinations(accepted, 2) if self.predictor.screening is None else ():
            alike = set.intersection(*(set(self.catalogue[name].lookalikes) for name in pair))
            for name in sorted(alike.intersection(self.catalogue) - set(accepted)):
                for one, tried in self._merged(problem, fit, pair, name):
                    if tried.held_out.sum() < best.held_out.sum() - 0.5 and self._may_stay(problem, tried, one):
                        best, new = tried, (*(a for a in accepted if a not in pair), one)
        if new == accepted:
            return problem, fit, accepted
        self.tick(new[-1])
        merged, settled = self._refit_with_noise(best.model, problem.pose_filter.noise)
        if any(self._rejected(settled, name, bounds=False) for name in new):
            return problem, fit, accepted
        return merged, settled, new

    def _merged(self, problem: Problem, fit: Fit, pair: tuple[str, str], name: str) -> Iterator[tuple[str, Fit]]:
        """An effect in the place of two, then each that extends it; none with more numbers than these have together."""
        most = sum(len(self.catalogue[one].parameters) for one in pair)
        base = problem.fit(fit.model.without(pair[0]).without(pair[1]))
        simple_fit = fit_with(problem, base, self.catalogue[name])
        yield name, simple_fit
        for effect in self._worth.values():
            if effect.extends == name and len(effect.parameters) <= most:
                yield effect.name, fit_extended(problem, simple_fit, effect)

    def _backward_step(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> tuple[Problem, Fit, tuple[str, ...]]:
        """Drop what no longer earns its place, and what can no longer be believed beside what came in."""
        problem, fit, accepted = self._shortened(problem, fit, accepted)
        newest = accepted[-1]
        for name in accepted:
            believed = not self._rejected(
                fit, name, bounds=False
            )  # at a bound it may be: there it does, and earns, nothing
            parts = extended(self.catalogue, name)
            longer = bool(parts) or any(a.replaces for a in fit.model.effects if a.effect.name == name)
            # an exchange since may have left it nothing to do; and what it extends may do as well from its numbers
            if believed and name == newest and not at_bound(fit, name) and not longer:
                continue
            simpler = reduced(self.catalogue, problem, fit, name)
            moved = variant(self.catalogue, name)
            needless = longer and not moved and not certainly_better((problem, simpler), (problem, fit))
            if not believed or needless or not self._stays(problem, simpler, fit, name):
                accepted = tuple(a for a in accepted if a != name) + parts
                problem, fit = self._refit_with_noise(simpler.model, problem.pose_filter.noise)
        return problem, fit, accepted

    def _shortened(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> tuple[Problem, Fit, tuple[str, ...]]:
        """Each effect that another contains takes the place of that one, unless the error is certainly higher then.

        It must lower the error itself, compared with what both of them extend: else the longer one may be what does.
        """
        for name in accepted:
            inside = shorter(self.catalogue, problem, fit, name)
            if inside is None or certainly_better((problem, inside[1]), (problem, fit)):
                continue
            if certainly_better((problem, reduced(self.catalogue, problem, fit, name)), (problem, inside[1])):
                accepted = tuple(inside[0] if a == name else a for a in accepted)
                problem, fit = self._refit_with_noise(inside[1].model, problem.pose_filter.noise)
        return problem, fit, accepted

    def _needed(self, problem: Problem, fit: Fit, name: str) -> bool:
        """Is the error certainly lower with an effect that extends another than with that other?"""
        return certainly_better((problem, reduced(self.catalogue, problem, fit, name)), (problem, fit))

    def _better_than_part(self, problem: Problem, fit: Fit, name: str) -> bool:
        """Whether an effect that extends another is `_needed`, as it must be to remain; any other effect is no part's rival."""
        return not extended(self.catalogue, name) or self._needed(problem, fit, name)

    def _stays(self, problem: Problem, simpler: Fit, fit: Fit, name: str) -> bool:
        """Whether an effect still earns its place; one that only acts elsewhere than the simpler one, by the better fit."""
        return fits_better(simpler, fit) if variant(self.catalogue, name) else self._earned_over(problem, simpler, fit, name)

    def _may_stay(self, problem: Problem, fit: Fit, name: str) -> bool:
        """Whether that effect of a fit would be taken as a newcomer: few trials that gain much do not bring one in."""
        simpler = reduced(self.catalogue, problem, fit, name)
        return not self._rejected(fit, name) and self._earned_over(problem, simpler, fit, name)

    def _earned_over(self, problem: Problem, lacking: Fit, fit: Fit, name: str) -> bool:
        return self._earned(Candidate(name, fit, problem.paired_comparison(lacking, fit)), lacking, 0.0)

    def _competing_models(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> list[tuple[tuple[str, ...], Fit]]:
        """Explanations of the same size, one effect exchanged, that these tracks cannot tell from the accepted one.

        What comes in must have earned its place: where trials disagree, much that earns nothing certain is no worse for certain.
        Nor may one with more numbers have one that may be anything: a warm-up of any length at all is a gain. Where a number is
        outside of what is plausible, it is the best plausible one that competes: a motor that never cools is a battery that sags.
        """
        competing_models: list[tuple[tuple[str, ...], Fit]] = []
        lacking = cache(partial(fit_without, problem, fit))
        for name, other, tried in self._exchanges.of(problem, fit, accepted):
            if len(tried.free) > len(fit.free) and limiting(tried, other):
                continue
            # at a bound it may be: a tether from ever farther away is a slope
            may = not self._rejected(tried, other, bounds=False) and self._earned_over(
                problem, lacking(name), tried, other
            )
            model = believable(tried, other) if may else None
            if may and indistinguishable(tried if model is None else problem.fit(model), fit, lacking(name)):
                competing_models.append((tuple(other if a == name else a for a in accepted), tried))
        return competing_models


def _per_trial_effect(model: Model) -> str:
    return model.per_trial_effect.effect.name if model.per_trial_effect else ""
