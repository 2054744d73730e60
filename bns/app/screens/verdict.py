"""What a diagnosis says on the page: the verdict, how large the effects are, what else it could be, and what to do next."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from bns.api.diagnose import DiagnoseResult
from bns.app.html import found_errors, found_numbers, mm
from bns.diagnose.design.competing_models import Rival
from bns.diagnose.report.plain_language import certainty, further_notes, headline
from bns.diagnose.report.tables import ahead

_SWITCH_ON = "Switch it on, see the error fall in the table, then save the extended model on the Next screen."
_EITHER = (
    "Switch on one of them: these measurements do not show which is right, and the table shows how well each predicts. The Next "
    "screen saves the model, and its next experiment says what would decide."
)
_UNLISTED = (
    "The screen “Where it fails” shows where and when the rest occurs. A formula of your own, below the effects, can describe it."
)


def verdict_html(result: DiagnoseResult, others: Sequence[Rival]) -> str:
    """All of it; every text is escaped."""
    d = result.diagnosis
    sure = certainty(d)
    words = "".join(f"<br>It behaves like this: {escape(each)}." for each in d.behaviour)
    sizes = found_numbers(d.numbers)
    either = "".join(f"<br>or{found_numbers(other.numbers)}" for other in others)
    then = _then(result)
    said = f"<b>{escape(headline(d))}</b> {escape(sure)}{sizes}{either}{words}" + (f"<br>{then}" if then else "")
    notes = "".join(f"<li>{escape(note)}</li>" for note in further_notes(d, formula=True) if note not in sure)
    listed = f"<ul id='bns-notes'>{notes}</ul>" if notes else ""
    return f"<p id='bns-verdict'>{said}</p>{listed}{found_errors(d.errors_with_terms or d.errors)}"


def _then(result: DiagnoseResult) -> str:
    """The next step of somebody who has read the verdict."""
    if result.verdict == "tie":
        return _EITHER
    if result.effects or result.diagnosis.terms:
        return _SWITCH_ON
    return {"none": _as_it_is(result), "unlisted": _UNLISTED}.get(result.verdict, "")


def _as_it_is(result: DiagnoseResult) -> str:
    """Nothing is missing: how good the model is, beside the best that these measurements could show."""
    errors = result.diagnosis.errors
    horizon = result.ready.predictor.near
    if errors is None or not errors.horizons[horizon].windows:
        return ""
    e = errors.horizons[horizon]
    return (
        f"The model's position error {ahead(horizon)} ahead is {mm(e.models[0].rms_m)} mm; the noise of the tracking alone "
        f"causes {mm(e.noise_floor_m)} mm. Nothing needs to be switched on: the Next screen saves it as it is, and the report."
    )
