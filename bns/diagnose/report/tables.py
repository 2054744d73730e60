"""The numbers behind the report's figures, as tables of texts: {columns, rows}."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

import numpy as np

from bns.diagnose.adding import ExtendedModel
from bns.diagnose.comparison import Comparison
from bns.diagnose.data.load import Measured
from bns.diagnose.design.proposal import Proposal
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.predict.horizons import IN_WORDS
from bns.diagnose.predict.paired_errors import Change, ModelError
from bns.diagnose.report.plain_language import figures_in_words, with_what
from bns.diagnose.values import numbers_of

Table = dict[str, list[Any]]


def ahead(horizon: str) -> str:
    """A horizon in words; one that says it itself stays as it is."""
    return IN_WORDS.get(horizon, horizon)


def error_table(d: Diagnosis, c: Comparison | None) -> Table | None:
    """Error at every horizon, before and after, beside the noise of the tracking.

    The change leads from the model as given to the last one that is accepted: terms that raise the error are not.
    """
    errors = d.errors_with_terms or d.errors or (c.judged if c is not None else None)
    if errors is None:
        return None
    shown = [e for e in errors.horizons.values() if e.windows]
    models = ["as given (mm)"]
    models += ["with the effects (mm)"] if d.effects else []
    accepted = len(models)
    if d.errors_with_terms is not None:
        rejected = d.terms_rejected
        models += ["with a term that was rejected (mm)" if rejected else "with what is left described, too (mm)"]
        accepted += not rejected
    changes = ["change, 95 % (mm)"] if accepted > 1 else []
    rows = [
        [
            ahead(e.horizon),
            *(_both(e.models[0 if index == 0 else index - len(models)]) for index in range(len(models))),
            *(_interval(e.total if accepted == len(e.models) else e.changes[0]) for _ in changes),
            _mm(e.noise_floor_m),
            str(e.windows),
        ]
        for e in shown
    ]
    return _table(["after", *models, *changes, "tracking noise (mm)", "windows"], rows)


def _both(m: ModelError) -> str:
    return f"{_mm(m.rms_m)} (median {_mm(m.median_m)})"


def _interval(change: Change | None) -> str:
    if change is None or not np.isfinite(change.low_m):
        return "too few trials"
    return f"{1e3 * change.low_m:+.2f} to {1e3 * change.high_m:+.2f}"


def improvement_text(d: Diagnosis) -> str:
    """What adding the effects does to the error, in a sentence; "" where nothing was added."""
    if d.errors is None or not d.effects:
        return ""
    shown = [e for h in ("1s", "command", "cycle", "stretch") for e in [d.errors.horizons.get(h)] if e is not None and e.windows]
    if not shown:
        return ""
    e = shown[0]
    ahead = {"1s": "a second", "command": "a command", "cycle": "a cycle", "stretch": "a stretch"}[e.horizon]
    known = with_what(d) if d.verdict != "unlisted" else "With the known effects alone"
    noise = f" (tracking noise alone: {_mm(e.noise_floor_m)} mm)" if np.isfinite(e.noise_floor_m) else ""
    before, after = _mm(e.models[0].rms_m), _mm(e.models[-1].rms_m)
    return f"{known}, predictions {ahead} ahead have an error of {after} mm instead of {before} mm{noise}."


def error_by_step_table(m: ExtendedModel) -> Table:
    """Every step at every horizon."""
    shown = [e for e in m.errors.horizons.values() if e.windows]
    rows = [
        [name if index == 0 else f"+ {name}", *(_both(e.models[index]) for e in shown)]
        for index, name in enumerate(m.names)
    ]
    rows.append(["tracking noise", *(_mm(e.noise_floor_m) for e in shown)])
    return _table(["model", *(f"{ahead(e.horizon)} (mm)" for e in shown)], rows)


def curves_table(c: Comparison) -> Table:
    """Every dot of the curves with its band."""
    rows = [
        [curve.variable, curve.direction, *(f"{v:.4g}" for v in dot)]
        for curve in c.curves
        for dot in zip(curve.centre, curve.mean, curve.low, curve.high, strict=True)
    ]
    return _table(["variable", "error", "at", "mean", "95 % from", "to"], rows)


def worst_table(c: Comparison) -> Table:
    """The worst moments."""
    rows = [[w.trial, f"{w.t_s:.2f}", _mm(w.position_m), f"{np.degrees(w.heading_rad):+.1f}"] for w in c.worst]
    return _table(["trial", "time (s)", "position error (mm)", "heading error (°)"], rows)


def ranking_table(d: Diagnosis) -> Table:
    """Every effect alone: gain with its interval, chance, fitted numbers, reason for a rejection."""
    assert d.selection is not None
    rows = []
    for c in d.selection.steps[0].ranking:
        e = c.paired_comparison
        fitted = numbers_of(c.fit).get(c.name, {})
        known = np.isfinite(e.elpd_diff)
        gain = (
            [f"{e.elpd_diff:.3g}", f"{e.elpd_diff - 1.96 * e.dse:.3g} to {e.elpd_diff + 1.96 * e.dse:.3g}"]
            if known
            else ["none", ""]
        )
        rows.append([c.name, *gain, f"{e.p_value:.2g}", in_line(fitted), c.rejected_because])
    alone = "parameters of this effect alone (95 %)"
    columns = ["effect", "gain per trial (log-likelihood)", "95 %", "p-value", alone, "why not considered"]
    return _table(columns, rows)


def in_line(numbers: Mapping[str, Mapping[str, Any]]) -> str:
    """Names, values and intervals in one line."""
    known = {name: n for name, n in numbers.items() if n["value"] is not None}
    return "; ".join(f"{name} {' '.join(part for part in _shown(n) if part)}" for name, n in known.items())


def _shown(number: Mapping[str, Any]) -> tuple[str, str]:
    value, interval = figures_in_words(number["value"], number["low"], number["high"], number["unit"])
    return value, f"({interval})" if interval else ""


def commands_table(p: Proposal) -> Table:
    """The proposed trial file."""
    table = p.commands()
    if p.arena is None:
        rows = [[int(row[0]), *(f"{value:.4f}" for value in row[1:])] for row in table.itertuples(index=False)]
        return _table(list(table.columns), rows)
    table = table.iloc[:, :4]
    rows = [[int(row[0]), f"{row[1]:.4f}", f"{row[2]:.4f}", f"{row[3]:.2f}"] for row in table.itertuples(index=False)]
    return _table(["trial", "left (m/s)", "right (m/s)", "duration (s)"], rows)


def exact_table(d: Diagnosis) -> Table:
    """The accepted effects' numbers in SI units."""
    assert d.selection is not None
    rows = [
        [effect, name, *(f"{n[k]:.6g}" if n[k] is not None else "" for k in ("value", "se", "low", "high")), n["unit"]]
        for effect, numbers in d.numbers.items()
        for name, n in numbers.items()
    ]
    return _table(["effect", "parameter", "value", "standard error", "95 % from", "to", "unit"], rows)


def equations_table(d: Diagnosis) -> Table:
    """What the accepted effects do, as equations, and what looks like them."""
    assert d.selection is not None
    accepted = [a.effect for a in d.selection.fit.model.effects if a.effect.name in d.effects]
    return _table(
        ["effect", "equation", "looks like"], [[e.name, e.equation, ", ".join(e.lookalikes)] for e in accepted]
    )


def findings_table(measured: Measured, most: int = 100) -> Table:
    """What was odd about the data."""
    return _table(["trial", "row", "what"], [[f.trial, f.row, f.text] for f in measured.findings[:most]])


def next_commands(d: Diagnosis, p: Proposal | None, command: Mapping[str, str]) -> list[str]:
    """What to type next. ``command``: words of `bns.api.common.next_command.repeated`; data and model suffice."""
    data, model = command["data"], command["model"]
    search = command.get("search", model)
    out = []
    if d.terms:  # fitted together with the effects: one after the other they would be others
        out.append(f"bns diagnose {data} {search} -o extended.yaml")
    elif d.effects:
        names = " ".join(command.get(f"effect {name}", name) for name in d.effects)
        out.append(f"bns add {data} {names} {model} -o extended.yaml")
    if d.formula and not d.terms:
        base = f"--model extended.yaml {command.get('shared', '')}".rstrip() if out else model
        term = f"--term {shlex.quote(d.formula.term)} --on {d.formula.on}"
        out.append(f"bns add {data} {d.formula.name} {term} {base} -o extended.yaml")
    if p is not None and len(p.plan):
        out.append(f"bns propose {data} {search} {command.get('limits', '')}".rstrip() + " -o next.csv")
        if p.bounds is not None and p.bounds.robot:
            out.append(f"bns trial --robot {p.bounds.robot} --rig RIG.yaml --commands next.csv")
        driven = "results/trials/experiment-next/measurements.csv" if p.bounds is not None and p.bounds.robot else "NEW-LOG.csv"
        out.append(f"bns diagnose {data} {search} --more {driven}")
    return [f"# first, in Python: {command['before']}", *out] if out and "before" in command else out


def _table(columns: list[str], rows: list[list[Any]]) -> Table:
    return {"columns": columns, "rows": rows}


def _mm(metres: float) -> str:
    size = 1e3 * metres
    return f"{size:.1f}" if np.isfinite(size) and size < 100 else f"{size:.0f}" if np.isfinite(size) else "not known"
