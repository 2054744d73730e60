"""Whether an effect is taken into a model, and whether it stays: what it earns on held-out trials, and if it can be believed."""

from __future__ import annotations

from collections.abc import Mapping

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.plausibility import at_bound, implausible, undetermined
from bns.diagnose.estimate.significance import PairedComparison
from bns.diagnose.select.extending import extended, fits_better, reduced, variant
from bns.diagnose.select.negligible import certainly_better
from bns.diagnose.select.result import Candidate
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect

MIN_GAIN = DEFAULTS.select.min_gain


class Acceptance:
    """What is asked of an effect of ``catalogue``; ``level``: the chance of a false alarm, ``least_z``: in standard errors.

    ``all_believed``: whether numbers beyond what is plausible are taken as well; a search may change it.
    """

    def __init__(self, catalogue: Mapping[str, Effect], level: float, least_z: float) -> None:
        self._catalogue, self._level, self._least_z = catalogue, level, least_z
        self.all_believed = False
        self.doubts = 0
        """How many decisions hung on a number that was not believed, and would be where all are."""

    def candidate(self, problem: Problem, fit: Fit, added: Fit, name: str) -> Candidate:
        """An effect added to a model, with what it earns and why it may not be taken."""
        return Candidate(name, added, problem.paired_comparison(fit, added), self._reason(added, name, True)[0])

    def refused(self, candidate: Candidate) -> bool:
        """Whether a candidate may not be taken, asked where that decides."""
        return bool(candidate.rejected_because and self.rejected(candidate.fit, candidate.name))

    def rejected(self, fit: Fit, name: str, bounds: bool = True) -> str:
        """Why an effect may not be taken; where all numbers are believed, only for one at a bound or not determined."""
        why, doubted = self._reason(fit, name, bounds)
        self.doubts += doubted
        return why

    def _reason(self, fit: Fit, name: str, bounds: bool) -> tuple[str, bool]:
        """Why an effect may not be taken, and whether that is for a number alone which could be believed."""
        known, why = undetermined(fit, name), implausible(fit, name, bounds)
        believable = bool(why) and not known and not at_bound(fit, name)
        return known or ("" if believable and self.all_believed else why), believable and not self.all_believed

    def earned(self, candidate: Candidate, before: Fit, decoy_threshold: float) -> bool:
        """Whether what a candidate gains over the fit before is certain, enough, and more than a decoy gains."""
        e = candidate.paired_comparison
        least = MIN_GAIN * float(before.held_out.mean())
        return self._sure(e) and e.elpd_diff > max(decoy_threshold, least)

    def certain(self, problem: Problem, before: Fit, after: Fit) -> bool:
        """Whether the gain on held-out trials from one fit to another is certain, however small it is."""
        return self._sure(problem.paired_comparison(before, after))

    def _sure(self, gain: PairedComparison) -> bool:
        return gain.p_value < self._level and gain.z > self._least_z

    def earned_over(self, problem: Problem, lacking: Fit, fit: Fit, name: str) -> bool:
        """Whether an effect of a fit has `earned` its place over the fit that lacks it."""
        return self.earned(Candidate(name, fit, problem.paired_comparison(lacking, fit)), lacking, 0.0)

    def may_stay(self, problem: Problem, fit: Fit, name: str) -> bool:
        """Whether that effect of a fit would be taken as a newcomer: few trials that gain much do not bring one in."""
        simpler = reduced(self._catalogue, problem, fit, name)
        return not self.rejected(fit, name) and self.earned_over(problem, simpler, fit, name)

    def stays(self, problem: Problem, simpler: Fit, fit: Fit, name: str) -> bool:
        """Whether an effect still earns its place; one that only acts elsewhere than the simpler one, by the better fit."""
        return fits_better(simpler, fit) if variant(self._catalogue, name) else self.earned_over(problem, simpler, fit, name)

    def needed(self, problem: Problem, fit: Fit, name: str) -> bool:
        """Is the error certainly lower with an effect that extends another than with that other?"""
        return certainly_better((problem, reduced(self._catalogue, problem, fit, name)), (problem, fit))

    def better_than_part(self, problem: Problem, fit: Fit, name: str) -> bool:
        """Whether an effect that extends another is `needed`, as it must be to remain; any other effect is no part's rival."""
        return not extended(self._catalogue, name) or self.needed(problem, fit, name)
