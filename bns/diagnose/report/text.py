"""Comparison and diagnosis in words and tables, for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from bns.diagnose.adding import ExtendedModel
from bns.diagnose.comparison import Comparison
from bns.diagnose.data.checks import Finding
from bns.diagnose.diagnosis import Diagnosis, numbers_of, ties_of
from bns.physics.decoys import DECOYS
from bns.physics.effects import all_effects

_VERDICTS = {
    "none": "Nothing is missing that these measurements could show.",
    "effects": "Missing from the model: {effects}.",
    "tie": "Missing from the model: {effects}; these measurements cannot tell it from others.",
    "unlisted": "Something is missing that no listed effect explains.",
    "insufficient-data": "These measurements do not suffice for a verdict.",
}
_SHOWN = 8


def findings_text(findings: tuple[Finding, ...], most: int = 10) -> str:
    """What was odd about the data; the first ones in full, the rest counted."""
    lines = [f"  trial {f.trial}, row {f.row}: {f.text}" for f in findings[:most]]
    if len(findings) > most:
        lines.append(f"  … and {len(findings) - most} more (--findings lists all)")
    return "\n".join([f"{len(findings)} findings in the data:", *lines]) if findings else "nothing odd in the data"


def diagnosis_text(d: Diagnosis) -> str:
    """Verdict first; then numbers, errors, ranking, notes."""
    return "\n".join(_diagnosis(d))


def _diagnosis(d: Diagnosis) -> Iterator[str]:
    yield f"verdict: {d.verdict}"
    yield _VERDICTS[d.verdict].format(effects=" and ".join(d.effects) or "nothing listed")
    if d.selection is not None:
        yield from _numbers(d)
        for group in ties_of(d.selection):
            yield "cannot be told apart: " + ", ".join(group)
        yield from _errors(d.error or {})
        yield from _ranking(d)
    if d.formula is not None:
        values = ", ".join(f"{name} = {value:.4g}" for name, value in d.formula.values.items())
        yield f"\ncandidate term: {d.formula.term}   added to {d.formula.on}; {values}"
        yield f"  bns add DATA unlisted --term '{d.formula.term}' --on {d.formula.on} … adds it"
    if d.notes:
        yield "\nnotes:"
        yield from (f"  - {note}" for note in d.notes)


def _numbers(d: Diagnosis) -> Iterator[str]:
    assert d.selection is not None
    for effect, numbers in numbers_of(d.selection.fit).items():
        for name, n in numbers.items():
            if n["low"] is not None and n["high"] is not None:
                yield f"  {effect}: {name} = {n['value']:.5g} {n['unit']} (95 %: {n['low']:.5g} to {n['high']:.5g})"
        if effect in all_effects():
            yield f"    {all_effects()[effect].equation}"


def _errors(error: Mapping[str, Mapping[str, float]]) -> Iterator[str]:
    yield "\nposition error on trials held out, mm (root mean square):"
    yield f"  {'horizon':10}{'before':>10}{'after':>10}{'noise':>10}"
    for horizon, e in error.items():
        yield f"  {horizon:10}" + "".join(f"{1e3 * e[k]:10.2f}" for k in ("before", "after", "noise_floor"))


def _ranking(d: Diagnosis) -> Iterator[str]:
    assert d.selection is not None
    yield "\neach effect added alone: gain on trials held out (log-likelihood a trial):"
    yield f"  {'effect':20}{'gain':>10}{'± se':>10}{'p':>10}"
    for c in d.selection.steps[0].ranking[:_SHOWN]:
        rejected = f"not considered: {c.rejected_because}" if c.rejected_because else ""
        e = c.paired_comparison
        yield f"  {c.name:20}{e.elpd_diff:10.3f}{e.dse:10.3f}{e.p_value:10.2g}  {rejected}".rstrip()
    yield f"  (the best of {len(DECOYS)} decoys: {d.selection.steps[0].decoy_threshold:.3f})"


def comparison_text(c: Comparison) -> str:
    """Errors at every horizon, what explains them, and the worst trials and moments."""
    return "\n".join(_comparison(c))


def _comparison(c: Comparison) -> Iterator[str]:
    yield f"{c.trials} trials, {c.frames} tracked poses, model {c.model}"
    yield "\nerror of predictions from the measured pose (root mean square):"
    yield f"  {'horizon':10}{'position mm':>14}{'forward':>10}{'left':>10}{'heading deg':>13}{'noise mm':>10}{'windows':>9}"
    for horizon, e in c.errors.items():
        if e["windows"]:
            yield (
                f"  {horizon:10}{1e3 * e['position_m']:8.2f} ±{1e3 * e['position_se_m']:4.2f}{1e3 * e['forward_m']:10.2f}"
                f"{1e3 * e['left_m']:10.2f}{57.29578 * e['heading_rad']:13.2f}{1e3 * c.floor[horizon]:10.2f}{e['windows']:9.0f}"
            )
    yield "  (noise: at most what tracking noise alone would show; the drive's own scatter comes on top)"
    yield "\nwhere it fails: what a free curve along each variable would explain, on trials held out:"
    yield f"  {'variable':30}{'velocity':16}{'share of loss':>14}{'p':>10}"
    for p in c.residual_dependence[:_SHOWN]:
        yield f"  {p.variable:30}{p.channel:16}{p.share:14.2%}{p.paired_comparison.p_value:10.2g}"
    yield from _scores(c.scores)
    yield f"\nworst trials and moments ({ahead(c.near)} ahead):"
    for w in c.worst:
        yield f"  trial {w.trial}, {w.t_s:.2f} s: {1e3 * w.position_m:.1f} mm, {57.29578 * w.heading_rad:+.1f} deg"


def ahead(horizon: str) -> str:
    """A horizon in words."""
    words = {"command": "one command", "1s": "1 s", "5s": "5 s", "trial": "whole trial", "cycle": "one cycle"}
    return words.get(horizon, horizon)


def _scores(scores: Mapping[str, Mapping[str, float]]) -> Iterator[str]:
    """What each network is worth, where the model is networks of cycles."""
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
    horizons = list(m.error_by_step[0].error)
    lines = [
        "position error on trials held out, mm (root mean square):",
        f"  {'model':28}" + "".join(f"{h:>10}" for h in horizons),
    ]
    for step in m.error_by_step:
        name = step.name if step.name == "nominal" else f"+ {step.name}"
        lines.append(f"  {name:28}" + "".join(f"{1e3 * step.error[h]:10.2f}" for h in horizons))
    lines.append(f"  {'noise floor':28}" + "".join(f"{1e3 * m.floor[h]:10.2f}" for h in horizons))
    for effect, numbers in numbers_of(m.fit).items():
        lines += [f"  {effect}: {name} = {n['value']:.5g} ± {n['se']:.2g} {n['unit']}" for name, n in numbers.items()]
    return "\n".join(lines)
