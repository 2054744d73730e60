"""A diagnosis as one HTML page that needs nothing else: no network, no other file, no manual."""

from __future__ import annotations

import base64
import json
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from bns.diagnose.adding import ExtendedModel, Memory, add_effects
from bns.diagnose.comparison import Comparison, compare
from bns.diagnose.data.bodies.stretches import StretchTracks
from bns.diagnose.data.load import Measured
from bns.diagnose.design.proposal import Proposal
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.starts import fitting
from bns.diagnose.predict.base import Predictor
from bns.diagnose.report import tables
from bns.diagnose.report.figures import comparison_figure, diagnosis_figure, error_by_step_figure
from bns.diagnose.report.plain_language import certainty, further_notes, head_of_page, numbers_in_words
from bns.diagnose.report.proposal_figure import plan_figure
from bns.diagnose.report.proposal_text import proposal_lines
from bns.diagnose.report.shown_paths import shown_paths
from bns.diagnose.values import numbers_of_term
from bns.errors import DataError
from bns.physics.model import Model

_PIXELS_IN_POINT = 1.25 * 96 / 72
"""A little larger than in print: a screen is read from further away."""


@dataclass(frozen=True)
class Material:
    """All that a report is made of. ``proposal`` is None where there is nothing to tell apart; ``why_none`` says why."""

    measured: Measured
    model: Model
    diagnosis: Diagnosis
    comparison: Comparison | None
    extended: ExtendedModel | None
    proposal: Proposal | None
    why_none: str
    paths: list[dict[str, Any]]
    near: str = "1s"
    """The horizon of curves and worst moments."""


def gathered(
    measured: Measured,
    predictor: Predictor,
    model: Model,
    d: Diagnosis,
    proposed: Callable[[], Proposal],
    tick: Callable[[str], None] = lambda _: None,
) -> Material:
    """Everything worked out that the page shows; ``proposed`` works out the experiment."""
    tick("where the model fails")
    try:
        comparison: Comparison | None = compare(predictor, model)
    except DataError:  # single poses: the verdict says so
        comparison = None
    extended = None
    if d.selection is not None and d.effects:
        tick("the error, step by step")
        added = {a.effect.name: (a.effect, a.written) for a in d.selection.fit.model.effects}
        memory, searched = Memory(), d.selection.problem.predictor
        memory.know(
            model, d.selection.problem, d.selection.fit, [fitting(added[n][0], model, searched.tracks) for n in d.effects]
        )
        extended = add_effects(searched, model, [added[name] for name in d.effects], measured, memory=memory)
    tick("the next experiment")
    proposal, why = None, ""
    try:
        proposal = proposed()
    except DataError as none:
        why = str(none)
    tick("paths")
    return Material(measured, model, d, comparison, extended, proposal, why, shown_paths(predictor, model, d), predictor.near)


def report_html(m: Material, command: Mapping[str, str]) -> str:
    """The page. ``command``: words of the user's command line that the next ones repeat: data, model."""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(_part("report.html.j2")).render(**_values(m, command))


def _origin(m: Material) -> str:
    """Names and digests of the logs and of the model."""
    each = "".join(f"{name}, SHA-256 {digest}…; " for name, digest in m.measured.files if digest)
    whole = f"together SHA-256 {m.measured.digest}…" if each else f"{m.measured.called}, SHA-256 {m.measured.digest}…"
    return f"Data {each}{whole}; model {m.model.name}, {m.model.digest}."


def _values(m: Material, command: Mapping[str, str]) -> dict[str, Any]:
    d, has_found = m.diagnosis, m.diagnosis.selection is not None
    has_after = bool(m.paths) and "after" in m.paths[0]
    head, causes = head_of_page(d)
    values: dict[str, Any] = {
        "css": Markup(_part("report.css")),
        "js": Markup(_part("report.js")),
        "data_name": m.measured.called,
        "model_name": m.model.name,
        "trials": len(m.measured.tracks),
        "verdict": d.verdict,
        "near": "one second" if m.near == "1s" else f"one {m.near}",
        "headline": head,
        "causes": causes,
        "certainty": certainty(d),
        "numbers": numbers_in_words(d.selection.fit, d.effects, d.numbers) if d.selection is not None else [],
        "moments": (*d.moments, *_of_all_terms(d)),
        "terms": _terms(d),
        "improvement": tables.improvement_text(d),
        "competing_models": _competing_models(m),
        "paths": Markup(json.dumps(m.paths, separators=(",", ":")).replace("<", "\\u003c")) if m.paths else "",
        "paths_text": _paths_text(m, has_after),
        "has_after": has_after,
        "errors": tables.error_table(d, m.comparison),
        "error_by_step": _drawn(partial(error_by_step_figure, m.extended), "error, effect by effect") if m.extended else None,
        "error_by_step_table": tables.error_by_step_table(m.extended) if m.extended else None,
        "comparison": _compared(m.comparison),
        "curves": tables.curves_table(m.comparison) if m.comparison else None,
        "worst": tables.worst_table(m.comparison) if m.comparison else None,
        "ranking": _drawn(partial(diagnosis_figure, d, errors=False), "what each effect would explain") if has_found else None,
        "ranking_table": tables.ranking_table(d) if has_found else None,
        "next_lines": proposal_lines(m.proposal) if m.proposal else [m.why_none],
        "plan_picture": _planned(m.proposal),
        "commands": tables.commands_table(m.proposal) if m.proposal and len(m.proposal.plan) else None,
        "notes": further_notes(d),
        "next_commands": tables.next_commands(d, m.proposal, command),
        "exact": tables.exact_table(d) if has_found and d.effects else None,
        "equations": tables.equations_table(d) if d.effects else None,
        "findings": tables.findings_table(m.measured) if m.measured.findings else None,
        "findings_title": f"{len(m.measured.findings)} irregularities in the data",
        "origin": _origin(m),
    }
    titles = {"paths": "paths", "errors": "errors", "comparison": "where it fails", "ranking": "every effect"}
    places = {"errors": "error", "comparison": "where"}
    shown = [(places.get(key, key), title) for key, title in titles.items() if values[key]]
    return {**values, "contents": [*shown, ("next", "next experiment"), ("details", "details")]}


def _terms(d: Diagnosis) -> list[dict[str, str]]:
    """What no effect explains, in words and as formulas that can be added; where there is none, a formula that was found."""
    if d.terms_rejected:
        return []
    terms = d.terms or ((d.formula,) if d.formula else ())
    words = d.terms_in_words or (d.formula_in_words or "A formula was found that explains a part of it",) * len(terms)
    return [
        {
            "words": said,
            "on": term.on,
            "term": term.term,
            "numbers": tables.in_line(numbers_of_term(term)),
        }
        for said, term in zip(words, terms, strict=True)
    ]


def _of_all_terms(d: Diagnosis) -> tuple[str, ...]:
    """What terms do that is not said of each, in clauses."""
    return () if d.terms_rejected else tuple(words for words in d.terms_said if words not in d.terms_in_words)


def _competing_models(m: Material) -> list[dict[str, str]]:
    """The numbers of explanations that fit as well as the accepted one."""
    if m.diagnosis.verdict != "tie" or m.proposal is None:
        return []
    others = m.proposal.competing_models[1:]
    return [
        number
        | {"effect": f"{number['effect']} ({competitor.title})" if len(competitor.names) > 1 else number["effect"]}
        for competitor in others
        for number in numbers_in_words(competitor.fit, competitor.names)
    ]


def _paths_text(m: Material, has_after: bool) -> str:
    shown, trials = len(m.paths), len(m.measured.tracks)
    order = "those with the largest errors first"
    if has_after:
        order = "those first in which the extended model differs most from the given one"
    some = f"{shown} of {trials} trials, {order}" if shown < trials else f"All {trials} trials, {order}"
    after = " The extended model predicts each trial with parameters that were fitted to other trials." if has_after else ""
    if isinstance(m.measured.tracks, StretchTracks):
        begun = f"Each {m.near} is predicted from the measured pose at its beginning"
        return f"{some}. {begun}; those that a small disturbance decides are excluded.{after}"
    return (
        f"{some}. Predictions start from the first measured pose and use only the commands. Even the path of a perfect model "
        f"departs from the measured one with time, because motors vary and the first heading is not exact.{after}"
    )


def _compared(c: Comparison | None) -> dict[str, Any] | None:
    if c is None or not c.curves:
        return None
    return _drawn(partial(comparison_figure, c), "errors along the variables that explain most of them")


def _planned(p: Proposal | None) -> dict[str, Any] | None:
    if p is None or not len(p.plan):
        return None
    return _drawn(partial(plan_figure, p), "the first proposed trials, as each explanation predicts them")


def _drawn(draw: Callable[..., Path], alt: str) -> dict[str, Any]:
    """A figure of the one style as data for the page, with the width that it is made for (pixels), and one for a phone."""
    with tempfile.TemporaryDirectory() as folder:
        wide, narrow = (draw(Path(folder) / "figure", narrow=thin).with_suffix(".svg").read_bytes() for thin in (False, True))
    points = float(wide[:1000].partition(b'width="')[2].partition(b"pt")[0])
    data, for_phone = (base64.b64encode(svg).decode() for svg in (wide, narrow))
    return {"data": data, "narrow": for_phone, "width": round(_PIXELS_IN_POINT * points), "alt": alt}


def _part(name: str) -> str:
    return (resources.files("bns.diagnose.report") / "template" / name).read_text(encoding="utf-8")
