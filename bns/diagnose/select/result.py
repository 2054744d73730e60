"""What a stepwise selection comes to: candidates, steps, and the result with its implausible numbers named."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bns.diagnose.estimate.cross_validation import held_out_steps
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.plausibility import implausible
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.significance import PairedComparison
from bns.diagnose.predict.paired_errors import paired_errors


@dataclass(frozen=True)
class Candidate:
    """One effect added to a model: its fit, what it earned on held-out trials, and why it may not be taken."""

    name: str
    fit: Fit
    paired_comparison: PairedComparison
    rejected_because: str = ""

    def slim(self) -> Candidate:
        """Without the innovations and the Jacobian: numbers, intervals and losses of the fit stay."""
        nothing, jacobian = np.zeros((0, 3)), np.zeros((0, 3, len(self.fit.free)))
        return replace(self, fit=replace(self.fit, whitened=nothing, jacobian=jacobian))


@dataclass(frozen=True)
class SelectionStep:
    """One round: all candidates, best first, the threshold that the decoys set, and what was selected ("" for nothing)."""

    ranking: tuple[Candidate, ...]
    decoy_threshold: float
    selected: str
    passed_over: str = ""
    """An implausible candidate that did clearly better than what was taken; "" if there was none."""
    of: int = 0
    """Among how many effects these were chosen, where only promising ones were fitted; 0: all are in the ranking."""
    instead_of: str = ""
    """The accepted effect whose place the selected one took, if that extends another."""

    @property
    def candidates(self) -> int:
        """Among how many effects the round chose; at least 1."""
        return max(self.of, len(self.ranking), 1)

    def slim(self) -> SelectionStep:
        """Without the innovations and Jacobians of what was tried."""
        return replace(self, ranking=tuple(candidate.slim() for candidate in self.ranking))


@dataclass(frozen=True)
class SelectionResult:
    """The end of a search: accepted names in order, their fit, the rounds, and explanations of the same size that fit as well."""

    problem: Problem
    nominal: Fit
    fit: Fit
    accepted: tuple[str, ...]
    steps: tuple[SelectionStep, ...]
    competing_models: tuple[tuple[str, ...], ...] = ()

    def implausible_in(self, fit: Fit) -> dict[str, str]:
        """Accepted effects whose numbers in a fit are beyond what is plausible: name -> why. No other set predicts as well.

        ``fit``: whose numbers are shown. Those of the search differ from them where flexible terms came in after it.
        """
        why = {name: implausible(fit, name, bounds=False) for name in self.accepted}
        return {name: text for name, text in why.items() if text}

    def only(self, names: tuple[str, ...]) -> SelectionResult:
        """The result with some of its effects, refitted."""
        if not names:
            return self.withdrawn()
        model = self.fit.model
        for name in self.accepted:
            model = model if name in names else model.without(name)
        problem = problem_for(self.problem.predictor, model, self.problem.pose_filter.noise)
        return replace(self, problem=problem, fit=problem.fit(model), accepted=names, competing_models=())

    def lacking(self, names: tuple[str, ...]) -> SelectionResult:
        """The result without some of its effects, refitted; of its competing models those that had them all, without them."""
        kept = self.only(tuple(name for name in self.accepted if name not in names))
        competing = (tuple(n for n in one if n not in names) for one in self.competing_models if set(names) <= set(one))
        return replace(kept, competing_models=tuple(competing))

    def withdrawn(self) -> SelectionResult:
        """The result without its effects: the model as it was, its numbers refitted."""
        problem = problem_for(self.problem.predictor, self.nominal.model)
        fit = problem.fit(self.nominal.model)
        return replace(self, problem=problem, nominal=fit, fit=fit, accepted=(), competing_models=())


def predicts_better(one: SelectionResult, other: SelectionResult) -> bool:
    """As `certainly_lower`, from one result to the other."""
    return certainly_lower((one.problem, one.fit), (other.problem, other.fit))


def certainly_lower(before: tuple[Problem, Fit], after: tuple[Problem, Fit], throughout: bool = False) -> bool:
    """Does the held-out error fall for certain from one fit to the other, at one horizon at least, and rise at none?

    ``throughout``: at every horizon that has windows enough for an interval.
    """
    predictor = before[0].predictor
    steps = [
        (name, held_out_steps(predictor, problem.pose_filter, fit.model))
        for name, (problem, fit) in (("before", before), ("after", after))
    ]
    errors = paired_errors(predictor, steps)
    fell = [e.total.fell for e in errors.horizons.values() if e.total is not None]
    return errors.falls and any(fell) and (all(fell) or not throughout)
