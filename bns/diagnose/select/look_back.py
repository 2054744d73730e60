"""The look back after each step of a search: accepted effects are exchanged, merged, replaced by shorter ones, or dropped."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import combinations

import numpy as np

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.plausibility import at_bound
from bns.diagnose.estimate.problem import settled_problem
from bns.diagnose.estimate.starts import fit_extended, fit_with
from bns.diagnose.predict.base import Predictor
from bns.diagnose.select.acceptance import Acceptance
from bns.diagnose.select.exchanges import Exchanges
from bns.diagnose.select.extending import extended, reduced, shorter, variant
from bns.diagnose.select.negligible import certainly_better
from bns.physics.effect import Effect


class LookBack:
    """The steps that change what was accepted, none of which adds to it.

    ``catalogue``, ``worth``: the search's own, which it may change, as it may what is asked of an effect (``acceptance``).
    """

    def __init__(
        self,
        predictor: Predictor,
        catalogue: Mapping[str, Effect],
        worth: Mapping[str, Effect],
        exchanges: Exchanges,
        acceptance: Acceptance,
        tick: Callable[[str], None],
    ) -> None:
        self._predictor, self._catalogue, self._worth, self._tick = predictor, catalogue, worth, tick
        self._exchanges, self._acceptance = exchanges, acceptance

    def exchange_step(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> tuple[Problem, Fit, tuple[str, ...]]:
        """Exchange an accepted effect for one that has earned its place too, while that makes the held-out loss smaller."""
        barred: set[str] = set()
        for _ in range(len(accepted)):
            best, new, comes = fit, accepted, ""
            same = self._exchanges.of(problem, fit, accepted) if len(accepted) > 1 else []
            for name, other, tried in [*same, *self._exchanges.longer(problem, fit, accepted)]:
                better = other not in barred and tried.held_out.sum() < best.held_out.sum() - 0.5
                better = better and self._acceptance.may_stay(problem, tried, other)
                if better and self._acceptance.better_than_part(problem, tried, other):
                    best, new, comes = tried, tuple(other if a == name else a for a in accepted), other
            if new == accepted:
                break
            exchanged, settled = settled_problem(self._predictor, best.model, problem.pose_filter.noise)
            if any(self._acceptance.rejected(settled, name, bounds=False) for name in new):
                barred.add(comes)  # under its own noise it asks for more
            else:
                problem, fit, accepted = exchanged, settled, new
        return problem, fit, accepted

    def merge_step(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> tuple[Problem, Fit, tuple[str, ...]]:
        """One effect in the place of two that both look like it, if it predicts trials held out better.

        A short lag is, to one half, a late clock, and to the other a limit of the acceleration. A search that took the one has a
        use for the other next, and no exchange of one effect leads from there to the lag. One that has a number more than the two
        must be better for certain: friction that ends turns is a loss of turn rate, and a lag that is shorter in turns. Not asked
        of bodies, whose fits take minutes.
        """
        best, new = fit, accepted
        for pair in combinations(accepted, 2) if self._predictor.screening is None else ():
            alike = set.intersection(*(set(self._catalogue[name].lookalikes) for name in pair))
            for name in sorted(alike.intersection(self._catalogue) - set(accepted)):
                for one, tried in self._merged(problem, fit, pair, name):
                    better = tried.held_out.sum() < best.held_out.sum() - 0.5 and self._acceptance.may_stay(problem, tried, one)
                    if better and (len(tried.free) <= len(fit.free) or self._acceptance.certain(problem, fit, tried)):
                        best, new = tried, (*(a for a in accepted if a not in pair), one)
        if new == accepted:
            return problem, fit, accepted
        self._tick(new[-1])
        merged, settled = settled_problem(self._predictor, best.model, problem.pose_filter.noise)
        if any(self._acceptance.rejected(settled, name, bounds=False) for name in new):
            return problem, fit, accepted
        return merged, settled, new

    def _merged(self, problem: Problem, fit: Fit, pair: tuple[str, str], name: str) -> Iterator[tuple[str, Fit]]:
        """An effect in the place of two, then each that extends it; with one number more than these have together at most."""
        most = 1 + sum(len(self._catalogue[one].parameters) for one in pair)
        base = problem.fit(fit.model.without(pair[0]).without(pair[1]))
        simple_fit = fit_with(problem, base, self._catalogue[name])
        yield name, simple_fit
        for effect in self._worth.values():
            if effect.extends == name and len(effect.parameters) <= most:
                found = fit_extended(problem, simple_fit, effect)
                yield effect.name, min(found, _from_their_numbers(problem, fit, pair, effect) or found, key=lambda one: one.loss)

    def backward_step(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> tuple[Problem, Fit, tuple[str, ...]]:
        """Drop what no longer earns its place, and what can no longer be believed beside what came in."""
        problem, fit, accepted = self._shortened(problem, fit, accepted)
        newest = accepted[-1]
        for name in accepted:
            # at a bound it may be: there it does, and earns, nothing
            believed = not self._acceptance.rejected(fit, name, bounds=False)
            longer = bool(extended(self._catalogue, name)) or _replaces_given(fit, name)
            # an exchange since may have left it nothing to do; and what it extends may do as well from its numbers
            if believed and name == newest and not at_bound(fit, name) and not longer:
                continue
            simpler, parts = self._without(problem, fit, name)
            moved = variant(self._catalogue, name)
            needless = longer and not moved and not certainly_better((problem, simpler), (problem, fit))
            if not believed or needless or not self._acceptance.stays(problem, simpler, fit, name):
                accepted = tuple(a for a in accepted if a != name) + parts
                problem, fit = settled_problem(self._predictor, simpler.model, problem.pose_filter.noise)
        return problem, fit, accepted

    def _without(self, problem: Problem, fit: Fit, name: str) -> tuple[Fit, tuple[str, ...]]:
        """The fit that lacks an effect, and what stands in its place: what it extends, where that earns a place itself.

        A patch under the wheels that is taken for one under the middle of the robot may predict worse than none.
        """
        simpler, parts = reduced(self._catalogue, problem, fit, name), extended(self._catalogue, name)
        if not parts or variant(self._catalogue, name) or _replaces_given(fit, name):
            return simpler, parts
        if self._acceptance.may_stay(problem, simpler, parts[0]):
            return simpler, parts
        return reduced(self._catalogue, problem, simpler, parts[0]), ()

    def _shortened(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> tuple[Problem, Fit, tuple[str, ...]]:
        """Each effect that another contains takes the place of that one, unless the error is certainly higher then.

        It must lower the error itself, compared with what both of them extend: else the longer one may be what does.
        """
        for name in accepted:
            inside = shorter(self._catalogue, problem, fit, name)
            if inside is None or certainly_better((problem, inside[1]), (problem, fit)):
                continue
            if certainly_better((problem, reduced(self._catalogue, problem, fit, name)), (problem, inside[1])):
                accepted = tuple(inside[0] if a == name else a for a in accepted)
                problem, fit = settled_problem(self._predictor, inside[1].model, problem.pose_filter.noise)
        return problem, fit, accepted


def _replaces_given(fit: Fit, name: str) -> bool:
    """Whether an effect stands in the place of one of the model as it was given."""
    return any(active.replaces for active in fit.model.effects if active.effect.name == name)


def _from_their_numbers(problem: Problem, fit: Fit, pair: tuple[str, str], effect: Effect) -> Fit | None:
    """The fit with an effect in the place of two, from their numbers of the same names; None if they have none.

    Far from both, under the small noise of a good model, a fit ends in another valley. A name may mean something else there: a
    number that this effect cannot have is none of its own.
    """
    known = {**fit.model.values_of(pair[0]), **fit.model.values_of(pair[1])}
    own = {p.name: known[p.name] for p in effect.parameters if p.low <= known.get(p.name, np.nan) <= p.high}
    if not own:
        return None
    bare = fit.model.without(pair[0]).without(pair[1])
    return problem.fit(bare.with_active(effect, tuple(own.get(p.name, p.neutral) for p in effect.parameters)))
