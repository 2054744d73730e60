"""What a diagnosis comes to: a verdict, everything it rests on, and the numbers that are shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from bns.diagnose.beside_terms import presented_fit, terms_rejected
from bns.diagnose.estimate.calibration import wheel_sizes
from bns.diagnose.estimate.cancelling import cancelled
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.smoothing_tracker import LATE
from bns.diagnose.predict.paired_errors import PairedErrors, noise_json, plain
from bns.diagnose.residuals.along_variables import ResidualDependence
from bns.diagnose.residuals.grammar import PAST
from bns.diagnose.residuals.outliers import one_wheel, what_they_did
from bns.diagnose.residuals.symbolic import Formula
from bns.diagnose.residuals.unexplained import NOTHING, Unexplained
from bns.diagnose.residuals.worst_trials import WithoutWorst
from bns.diagnose.select.result import SelectionResult
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.values import before_and_after, dependence_values, numbers_of, numbers_of_term, ranked_values, ties_of
from bns.physics.model import Model

VERDICTS = ("none", "effects", "tie", "unlisted", "insufficient-data")
OFTEN = DEFAULTS.verdict.often


@dataclass(frozen=True)
class Diagnosis:
    """A verdict and everything it rests on. ``selection`` is None where there was too little to search."""

    verdict: str
    selection: SelectionResult | None
    residual_dependence: tuple[ResidualDependence, ...] = ()
    rest: Unexplained = NOTHING
    formula: Formula | None = None
    """The first of the terms; where there are none, a formula that is fitted to the effects and earns something."""
    terms: tuple[Formula, ...] = ()
    """What no effect explains, as terms that can be added one after the other; their fit has the effects and all of them."""
    terms_in_words: tuple[str, ...] = ()
    """One text a term, to stand beside its formula."""
    terms_said: tuple[str, ...] = ()
    """What the terms do (`said_of`): of those that cancel one another, only their sum is said; if empty, as `terms_in_words`."""
    formula_in_words: str = ""
    """Of the formula, where there are no terms."""
    negligible: Mapping[str, dict[str, dict[str, Any]]] = field(default_factory=dict)
    """Effects that are certain but change no error by as much as `least_fall`, with their numbers; not among the accepted."""
    imitating: tuple[str, ...] = ()
    """Effects that a search without the terms accepts, and that earn too little beside them."""
    errors: PairedErrors | None = None
    """Of the model as given and, where effects were accepted, of the model with them: on trials held out."""
    errors_with_terms: PairedErrors | None = None
    """The same, and of the model with effects and terms."""
    notes: tuple[str, ...] = ()
    without_worst: WithoutWorst | None = None
    """Where trials stand out as a whole: what is said with them and without them. What is presented is said without them."""
    calibration: Fit | None = None
    """Of single relative motions: all numbers of robot and sensor fitted together (`calibrated`)."""

    def slim(self) -> Diagnosis:
        """Without the innovations and Jacobians of what was only tried: numbers, intervals and losses of these stay."""
        if self.selection is None:
            return self
        return replace(self, selection=replace(self.selection, steps=tuple(step.slim() for step in self.selection.steps)))

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the accepted effects, in the order in which they were found."""
        return self.selection.accepted if self.selection else ()

    @property
    def model(self) -> Model | None:
        """The model refitted with all accepted effects, without the terms: `errors` are of it.

        Where there are terms its numbers differ from `numbers`, which `model_with_terms` has.
        """
        return self.selection.fit.model if self.selection else None

    @property
    def model_with_terms(self) -> Model | None:
        """The model with the effects and all terms, fitted together: `errors_with_terms` are of it; None without terms."""
        return self.terms[0].fit.model if self.terms else None

    @property
    def terms_rejected(self) -> bool:
        """As `bns.diagnose.beside_terms.terms_rejected`."""
        return terms_rejected(self.errors_with_terms)

    @property
    def presented(self) -> Fit:
        """The fit whose numbers are shown (`presented_fit`); there must have been a search."""
        assert self.selection is not None
        return presented_fit(self.selection, self.terms, self.errors_with_terms)

    def as_json(self) -> dict[str, Any]:
        """One object of plain values, as `bns diagnose --json` prints it."""
        selection = self.selection
        return {
            "verdict": self.verdict,
            "effects": list(self.effects),
            "implausible": selection.implausible_in(self.presented) if selection else {},
            "parameters": self.numbers,
            "negligible": dict(self.negligible),
            "imitating": list(self.imitating),
            "ties": ties_of(selection) if selection else [],
            "explanations": [list(selection.accepted), *map(list, selection.competing_models)] if selection else [],
            "ranking": [ranked_values(c) for c in (selection.steps[0].ranking if selection else ())],
            "error": before_and_after(self.errors) if self.errors else {},
            "tracking_noise": noise_json(self.errors) if self.errors else None,
            "formula": self._formula(),
            "terms": self._terms(),
            "behaviour": list(self.behaviour),
            "error_with_terms": before_and_after(self.errors_with_terms) if self.errors_with_terms else {},
            "residual_dependence": [dependence_values(p) for p in self.residual_dependence],
            "without_worst": self._without_worst(),
            "outliers": [vars(o) for o in self.rest.outliers],
            "command_times": asdict(self.rest.command_times) if self.rest.command_times else None,
            "outliers_share": {**vars(self.rest.shared), "in_words": self.rest.shared.in_words} if self.rest.shared else None,
            "outliers_place": {**vars(self.rest.place), "in_words": self.rest.place.in_words} if self.rest.place else None,
            "floor_lines": [asdict(lines) | {"in_words": lines.in_words} for lines in self.rest.lines],
            "notes": list(self.notes),
            "calibration": numbers_of(self.calibration) if self.calibration else {},
            "wheel_sizes": {
                side: {"value": value, "low": low, "high": high}
                for side, (value, low, high) in (wheel_sizes(self.calibration) if self.calibration else {}).items()
            },
        }

    @property
    def behaviour(self) -> tuple[str, ...]:
        """What no effect explains, in clauses: a swing, the variable it follows most where no term stands, lines on the floor,
        `moments`, terms that stand."""
        terms = () if self.terms_rejected else self.terms_said or self.terms_in_words
        most = self.rest.residual_dependence[:1] if not terms else ()
        swing = self.rest.autocorrelation.clause if self.rest.autocorrelation is not None else ""
        lines = (one.in_words for one in self.rest.lines)
        return *filter(None, [swing]), *(p.in_words for p in most), *lines, *self.moments, *terms

    @property
    def moments(self) -> tuple[str, ...]:
        """In clauses: commands at times that scatter or follow something, moments that stand out, and what these share."""
        moments, times = self.rest.outliers, self.rest.command_times
        scattered = (times.in_words,) if times is not None else ()
        if not moments or self.selection is None:
            return scattered
        trials = len(self.selection.problem.predictor.tracks)
        often = "the error is large at some moments, too often for accidents"
        what = often if len(moments) >= OFTEN * trials else "the error is large for a moment"
        worst = f"in {len(moments)} of {trials} trials {what}; the worst is {moments[0].in_words}"
        share = self.rest.shared or self.rest.place
        shared = share.in_words if share is not None else ""
        return tuple(filter(None, (*scattered, worst, what_they_did(moments), one_wheel(moments), shared)))

    @property
    def numbers(self) -> dict[str, dict[str, dict[str, Any]]]:
        """The numbers of the effects: where terms were found that may be added, as fitted beside these, which keep them unbiased.

        Of single relative motions: as calibrated together, since an effect that was not accepted has a number there, too. Numbers
        that cancel a part of a term are marked ``cancels``; delays beside commands that come at times that differ, ``of_mean``.
        """
        if self.selection is None:
            return {}
        if self.calibration is not None and not self.terms:
            together = numbers_of(self.calibration)
            return {name: together.get(name, values) for name, values in numbers_of(self.selection.fit).items()}
        fit = self.presented
        own = {term.name for term in self.terms}
        found = {name: values for name, values in numbers_of(fit).items() if name not in own}
        if fit is not self.selection.fit:
            past = any(term.signal in PAST for term in self.terms)
            for one in cancelled(self.selection.fit, fit, self.selection.accepted, past):
                found[one.name][one.parameter.name]["cancels"] = True
        for name in LATE if self.rest.command_times is not None else ():
            if name in found:
                found[name][LATE[name]]["of_mean"] = True
        return found

    def _without_worst(self) -> dict[str, Any] | None:
        if self.without_worst is None:
            return None
        one = self.without_worst
        said = {"with_them": one.with_them, "without": one.without}
        seen = [{"trial": a.trial, "times": plain(a.times), "share_of_moment": plain(a.share)} for a in one.apart]
        both = {k: {"verdict": v, "effects": list(e)} for k, (v, e) in said.items()}
        return {"trials": list(one.trials), "apart": seen, **both}

    def _terms(self) -> list[dict[str, Any]]:
        return [
            {
                "name": term.name,
                "on": term.on,
                "term": term.term,
                "signal": term.signal,
                "in_words": words,
                "values": {k: plain(v) for k, v in term.values.items()},
                "parameters": numbers_of_term(term),
                "elpd_diff": plain(term.paired_comparison.elpd_diff),
            }
            for term, words in zip(self.terms, self.terms_in_words, strict=True)
        ]

    def _formula(self) -> dict[str, Any] | None:
        if self.formula is None:
            return None
        comparison = self.formula.paired_comparison
        return {
            "on": self.formula.on,
            "term": self.formula.term,
            "in_words": self.formula_in_words,
            "values": {k: plain(v) for k, v in self.formula.values.items()},
            "elpd_diff": plain(comparison.elpd_diff),
            "dse": plain(comparison.dse),
            "p_value": comparison.p_value,
        }
