"""Comparison and diagnosis in words and tables, for a terminal."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from bns.diagnose.adding import ExtendedModel
from bns.diagnose.comparison import Comparison
from bns.diagnose.data.checks import Finding
from bns.diagnose.design.competing_models import Rival
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.effect_caveats import implausible_texts
from bns.diagnose.estimate.calibration import wheel_sizes
from bns.diagnose.estimate.fit import without_width
from bns.diagnose.predict.paired_errors import Change, PairedErrors
from bns.diagnose.report.plain_language import ABOVE_NOISE, further_notes, nothing_above_noise
from bns.diagnose.report.sized import sized_sentence
from bns.diagnose.residuals.symbolic import Formula
from bns.diagnose.select.known_effects import known_effects
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.values import numbers_of, numbers_of_term, ties_of
from bns.physics.decoys import DECOYS
from bns.physics.effect import Effect
from bns.physics.figures import LEAST_OF_INTERVAL, figures_of_interval, with_unit

_VERDICTS = {
    "none": "Nothing is missing that these measurements could show.",
    "effects": "Missing from the model: {effects}.",
    "tie": "Missing from the model: {effects}, or an alternative that these measurements cannot tell from {them}.",
    "unlisted": "Something is missing that no listed effect explains.",
    "insufficient-data": "These measurements do not suffice for a verdict.",
}
UNKNOWN_NOISE = (
    f"it takes poses at rest, or {DEFAULTS.data.parabola_frames} poses of one command in a row at "
    f"{DEFAULTS.data.parabola_slowest_hz:g} Hz or more"
)
_OF_NOISE = {
    "at rest": "poses at rest",
    "high frequency": "poses at high frequency",
    "at rest, high frequency": "poses at high frequency; those at rest scatter alike",
    "rounding": "how far they are rounded",
}
_SHOWN = DEFAULTS.report.rows
_WIDTH = DEFAULTS.report.formula_width
_EXTENDED = "EXTENDED.yaml"


def findings_text(findings: tuple[Finding, ...], most: int = 10) -> str:
    """What was odd about the data; the first ones in full, the rest counted."""
    lines = [f"  {f'trial {f.trial}, ' if f.trial else ''}row {f.row}: {f.text}" for f in findings[:most]]
    if len(findings) > most:
        lines.append(f"  … and {len(findings) - most} more (--findings lists all)")
    many = "1 irregularity" if len(findings) == 1 else f"{len(findings)} irregularities"
    if not findings:
        return "no irregularities in the data"
    return "\n".join([f"{many} in the data (rows of the table are counted from 0):", *lines])


def diagnosis_text(d: Diagnosis, rivals: Sequence[Rival] = (), command: Mapping[str, str] | None = None) -> str:
    """Verdict first; then numbers, also those of explanations that fit as well, errors, ranking, notes.

    ``command``: words (data, model) of the command line that the next ones repeat.
    """
    return "\n".join(_diagnosis(d, rivals, command or {"data": "LOG", "model": "--model MODEL"}))


def _diagnosis(d: Diagnosis, rivals: Sequence[Rival], command: Mapping[str, str]) -> Iterator[str]:
    yield f"verdict: {d.verdict}"
    if d.verdict == "unlisted" and d.effects:
        yield f"Missing from the model: {_named(d)}, and something that no listed effect explains."
    else:
        them = "it" if len(d.effects) == 1 else "them"
        said = _VERDICTS[d.verdict].format(effects=enumerated(d.effects) or "nothing listed", them=them)
        yield f"{said} {ABOVE_NOISE}" if nothing_above_noise(d) else said
    odd = [*implausible_texts(d.selection, d.presented)] if d.selection else []
    yield from odd
    if d.selection is not None:
        known = known_effects(d.selection)
        yield from _effects(d.numbers, known)
        yield from _behaviour(d)
        for rival in rivals:
            yield f"or {' and '.join(rival.names)}:"
            yield from _effects_but(d.numbers, rival.numbers, known)
        for group in ties_of(d.selection):
            yield "cannot be told apart: " + ", ".join(group)
        yield from _errors(d.errors_with_terms or d.errors)
        yield from _ranking(d)
    if d.calibration is not None:
        yield "\nrobot and sensor calibrated together, each parameter with all others free:"
        yield from _intervals(numbers_of(d.calibration))
        for side, (value, low, high) in wheel_sizes(d.calibration).items():
            yield f"  {side} wheel: {value:.5g} of the drawing's size (95 %: {low:.5g} to {high:.5g})"
    yield from _terms(d)
    if d.formula is not None and not d.terms:
        yield from _hint(d.formula, d.formula_in_words, command, bool(d.effects))
    notes = [note for note in further_notes(d) if note not in odd]
    if notes:
        yield "\nnotes:"
        yield from (f"  - {note}" for note in notes)


def enumerated(names: Sequence[str]) -> str:
    """Names with commas, and "and" before the last."""
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def _named(d: Diagnosis) -> str:
    """The accepted effects, each with those that these measurements cannot tell from it."""
    ties = ties_of(d.selection) if d.selection is not None else []
    others = {name: [one for one in group if one != name] for group in ties for name in group}
    return enumerated([f"{name} (or {' or '.join(others[name])})" if others.get(name) else name for name in d.effects])


def _effects(values: Mapping[str, Mapping[str, Mapping[str, Any]]], known: Mapping[str, Effect]) -> Iterator[str]:
    """Each effect: what happens, and how much; its numbers with their intervals; its equation."""
    for name, numbers in values.items():
        yield f"  {name}: {sized_sentence(known[name], numbers)}" if name in known else f"  {name}"
        shown = {key: n for key, n in numbers.items() if n["low"] is not None and n["high"] is not None}
        yield from (f"    {_number(key, n)}" for key, n in shown.items())
        if name in known:
            yield f"    {known[name].equation}"


def _effects_but(
    above: Mapping[str, Mapping[str, Mapping[str, Any]]],
    values: Mapping[str, Mapping[str, Mapping[str, Any]]],
    known: Mapping[str, Effect],
) -> Iterator[str]:
    """As `_effects`; an effect whose numbers all lie in their intervals ``above`` is not written again."""
    for name, numbers in values.items():
        if name in above and all(_within(number, above[name].get(key, {})) for key, number in numbers.items()):
            yield f"  {name}: as above"
        else:
            yield from _effects({name: numbers}, known)


def _within(number: Mapping[str, Any], interval: Mapping[str, Any]) -> bool:
    low, value, high = interval.get("low"), number.get("value"), interval.get("high")
    return low is not None and value is not None and high is not None and bool(low <= value <= high)


def _behaviour(d: Diagnosis) -> Iterator[str]:
    """What no effect explains: in a line, or a list where it is several things."""
    begun = "Beyond these effects, the robot behaves like this:" if d.effects else "It behaves like this:"
    if len(d.behaviour) == 1:
        yield f"{begun} {d.behaviour[0]}."
    elif d.behaviour:
        yield begun
        yield from (f"  - {words}." for words in d.behaviour)


def _terms(d: Diagnosis) -> Iterator[str]:
    """The terms as formulas; of a long one, where it is written."""
    begun = "rejected" if d.terms_rejected else "candidate"
    for term in d.terms:
        numbers = numbers_of_term(term)
        if len(term.term) <= _WIDTH:
            yield f"\n{begun} term {term.name}, added to {term.on}: {term.term}"
            yield from _intervals({term.name: numbers})
            continue
        written = "" if d.terms_rejected else " and in the model that -o FILE writes"
        yield (
            f"\n{begun} term {term.name} ({term.signal}), added to {term.on}: {len(numbers)} numbers; the formula is in the "
            f"output of --json{written}"
        )


def _hint(formula: Formula, words: str, command: Mapping[str, str], beside: bool) -> Iterator[str]:
    """A formula that is no part of the extended model: what it says, and the command that adds it.

    ``beside``: it was fitted beside effects, and says nothing of a model that lacks them.
    """
    said = f"{words};\n  " if words else ""
    yield f"\nhint, not part of the extended model: {said}candidate term {formula.name}, added to {formula.on}: {formula.term}"
    yield from _intervals({formula.name: numbers_of_term(formula)})
    term = f"{formula.name} --term {shlex.quote(formula.term)} --on {formula.on}"
    first, model = "to try it", command["model"]
    if beside:
        first = f"to add it to the extended model (written with -o {_EXTENDED})"
        model = f"--model {_EXTENDED} {command.get('shared', '')}".strip()
    yield f"    {first}: bns add {command['data']} {term} {model} -o NEW.yaml"


def _intervals(values: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> Iterator[str]:
    for effect, numbers in values.items():
        for name, n in numbers.items():
            if n["low"] is not None and n["high"] is not None:
                yield _with_interval(effect, name, n)


def _with_interval(effect: str, name: str, n: Mapping[str, Any]) -> str:
    return f"  {effect}: {_number(name, n)}"


def _number(name: str, n: Mapping[str, Any]) -> str:
    no_width = without_width(n["low"], n["high"])
    digits = LEAST_OF_INTERVAL if no_width else figures_of_interval(n["value"], n["low"], n["high"])
    said = f"{name} = {n['value']:.{digits}g}{with_unit(n['unit'])}"
    if no_width:
        loose = "one trial only, or no small change changes the loss"
        why = "it is at the bound of what it can be" if n.get("at_bound") else loose
        return f"{said} (no interval: {why})"
    mean = ", perhaps only the mean of delays that differ: see the notes" if n.get("of_mean") else ""
    beside = ", together with the free term only: see the notes" if n.get("cancels") else mean
    return f"{said} (95 %: {n['low']:.{digits}g} to {n['high']:.{digits}g}{beside})"


def _errors(errors: PairedErrors | None) -> Iterator[str]:
    if errors is None:
        return
    yield f"\nposition error on {_whose(errors)}, mm: root mean square (median), all on the same windows:"
    yield from error_lines(errors)


def _whose(errors: PairedErrors) -> str:
    return "held-out trials" if errors.trials > 1 else "the one trial, to which the numbers were fitted (none is held out)"


def _why_unknown(horizons: Iterable[str]) -> str:
    """Why the noise of the tracker is not known, where it is not."""
    return "of a body only the ends of a stretch are compared" if {"cycle", "stretch"} & set(horizons) else UNKNOWN_NOISE


def error_lines(errors: PairedErrors, before_added: str = "", of_noise: bool = True) -> Iterator[str]:
    """A table of the errors of models in turn, one row a horizon and model, with the change from the one before.

    ``before_added``: stands before the names of all models but the first. ``of_noise``: say at the end what the noise is.
    """
    yield f"  {'horizon':10}{'model':26}{'error':>16}{'change (95 %)':>30}{'noise':>8}{'windows':>9}"
    for horizon, e in errors.horizons.items():
        if not e.windows:
            continue
        for index, m in enumerate(e.models):
            change, verdict = _change(e.changes[index - 1]) if index else ("", "")
            noise = f"{1e3 * e.noise_floor_m:8.2f}" if np.isfinite(e.noise_floor_m) else f"{'?':>8}"
            ends = f"{noise}{e.windows:9d}" if index == 0 else ""
            error, name = "{:>8} ({:>5})".format(*_mm(m.rms_m, m.median_m)), (before_added if index else "") + m.name
            yield f"  {horizon if index == 0 else '':10}{name:26}{error}{change:>30}{ends}{verdict}".rstrip()
    if any(e.left_out for e in errors.horizons.values()):
        left_out = ", ".join(f"{e.left_out} at {h}" for h, e in errors.horizons.items() if e.left_out)
        yield f"  (windows excluded because the tracker jumps within them or poses were left out: {left_out})"
    if not of_noise:
        return
    if errors.noise is None:
        yield f"  (noise not known: {_why_unknown(errors.horizons)})"
    else:
        pose_mm, basis = 1e3 * errors.noise.position_m, errors.noise.basis
        of = _OF_NOISE.get(basis, basis)
        least = "at least " if errors.noise.is_lower_bound else ""
        yield f"  (noise: error that the tracking alone causes; {least}{pose_mm:.2f} mm per pose, estimated from {of})"


def _change(c: Change) -> tuple[str, str]:
    """The change with its interval, and what stands behind it where the error does not fall."""
    if not np.isfinite(c.low_m):
        return f"{1e3 * c.change_m:+.2f} (too few trials)", ""
    verdict = "" if c.fell else "  rises" if c.rose else "  undecided"
    return "{} ({} to {})".format(*_mm(c.change_m, c.low_m, c.high_m, sign="+")), verdict


def _mm(*metres: float, sign: str = "") -> list[str]:
    """In millimetres, with as many decimals as the largest has room for."""
    digits = 0 if any(abs(1e3 * one) >= 1000 for one in metres) else 2
    return [f"{1e3 * one:{sign}.{digits}f}" for one in metres]


def _ranking(d: Diagnosis) -> Iterator[str]:
    assert d.selection is not None
    yield "\neach effect added alone: gain on held-out trials (log-likelihood per trial):"
    yield f"  {'effect':20}{'gain':>10}{'± se':>10}{'p':>10}"
    ranking = d.selection.steps[0].ranking
    shown = [*ranking[:_SHOWN], *(c for c in ranking[_SHOWN:] if c.name in d.effects)]
    for c in shown:
        rejected = f"not considered: {c.rejected_because}" if c.rejected_because else ""
        e = c.paired_comparison
        yield f"  {c.name:20}{e.elpd_diff:10.3f}{e.dse:10.3f}{e.p_value:10.2g}  {rejected}".rstrip()
    if any(c.rejected_because for c in shown):
        yield "  (not considered: alone, it fits only with a number that no robot has, or that these data leave open)"
    ranked = [c.name for c in ranking]
    later = [name for name in d.effects if name not in ranked]
    if later:
        yield f"  (not tried alone, but found later in the search: {', '.join(later)})"
    yield f"  (gain of the best of {len(DECOYS)} decoys: {d.selection.steps[0].decoy_threshold:.3f})"


def comparison_text(c: Comparison) -> str:
    """Errors at every horizon, what explains them, and the worst trials and moments."""
    return "\n".join(_comparison(c))


def _comparison(c: Comparison) -> Iterator[str]:
    yield f"{c.trials} trial{'' if c.trials == 1 else 's'}, {c.frames} tracked poses, model {c.model}"
    scattered = "±: standard error over trials" if c.trials > 1 else "one trial has no standard error"
    yield f"\nerror of predictions from the measured pose (root mean square; {scattered}):"
    yield f"  {'horizon':10}{'position mm':>14}{'forward':>10}{'left':>10}{'heading deg':>13}{'noise mm':>10}{'windows':>9}"
    for horizon, e in c.errors.items():
        if e["windows"]:
            noise = f"{1e3 * c.noise_floor_m(horizon):10.2f}" if np.isfinite(c.noise_floor_m(horizon)) else f"{'?':>10}"
            scatter = f" ±{1e3 * e['position_se_m']:4.2f}" if np.isfinite(e["position_se_m"]) else f"{'':6}"
            yield (
                f"  {horizon:10}{1e3 * e['position_m']:8.2f}{scatter}{1e3 * e['forward_m']:10.2f}"
                f"{1e3 * e['left_m']:10.2f}{57.29578 * e['heading_rad']:13.2f}{noise}{e['windows']:9.0f}"
            )
    if c.judged.noise is None:
        yield f"  (noise not known: {_why_unknown(c.errors)})"
    else:
        least = ", at least" if c.judged.noise.is_lower_bound else ""
        yield f"  (noise: error that tracking noise alone would cause{least}; the scatter of the drive is not included)"
    if c.hint:
        yield f"  {c.hint}"
    for errors in c.beside:
        other = next(iter(errors.horizons.values())).models[1].name
        yield f"\n{other} beside {c.model}, mm: root mean square (median), both as they are, on the same windows:"
        yield from error_lines(errors, of_noise=False)
    yield "\nwhere it fails: fraction of the loss that a free curve along each variable would remove, on held-out trials:"
    yield f"  {'variable':30}{'velocity':16}{'fraction':>14}{'p':>10}"
    for p in c.residual_dependence[:_SHOWN]:
        yield f"  {p.variable:30}{p.channel:16}{p.share:14.2%}{p.paired_comparison.p_value:10.2g}"
    yield from _scores(c.scores)
    yield f"\nworst trials and moments ({ahead(c.near)} ahead):"
    for w in c.worst:
        yield f"  trial {w.trial}, {w.t_s:.2f} s: {1e3 * w.position_m:.1f} mm, {57.29578 * w.heading_rad:+.1f} deg"


def ahead(horizon: str) -> str:
    """A horizon in words."""
    words = {"command": "one command", "1s": "1 s", "5s": "5 s", "trial": "whole trial"}
    words |= {"cycle": "one cycle", "stretch": "one stretch"}
    return words.get(horizon, horizon)


def _scores(scores: Mapping[str, Mapping[str, float]]) -> Iterator[str]:
    """How well each network predicts, where the model is networks of cycles."""
    if scores:
        yield "\nnetworks (displacements: predicted against measured; R² of the regression; mm):"
    for name, s in scores.items():
        if "rmse" in s:
            yield (
                f"  {name:12} R² {s['regression_r2']:5.2f}  slope {s['slope']:5.2f}  error {1e3 * s['rmse']:6.1f}  "
                f"bias {1e3 * s['bias']:+6.1f}"
            )
        else:
            yield f"  {name:12} " + "  ".join(f"{kind.replace('_', ' ')} {share:.0%}" for kind, share in s.items())


def extension_text(m: ExtendedModel) -> str:
    """The error by step on held-out trials, and the numbers."""
    lines = [f"position error on {_whose(m.errors)}, mm: root mean square (median), all on the same windows:"]
    lines += error_lines(m.errors, "+ ")
    for effect, numbers in numbers_of(m.fit).items():
        lines += [
            _with_interval(effect, name, n)
            if n["low"] is not None and n["high"] is not None
            else f"  {effect}: {name} = {n['value']:.5g} ± {n['se']:.2g}{with_unit(n['unit'])} (standard error)"
            for name, n in numbers.items()
        ]
    lines += [f"  warning: {text}" for text in m.warnings]
    return "\n".join(lines)
