"""A proposed experiment in words, for a terminal and for the report."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bns.diagnose.proposal import Contest, Proposal


def proposal_text(p: Proposal, written: str = "") -> str:
    """Who stands against whom, what the experiment would decide, and what to type next."""
    return "\n".join(_lines(p, written))


def contest_text(c: Contest) -> str:
    """One sentence or two on one pair."""
    pair = f"{c.first} against {c.second}"
    if c.alike:
        other = "; or ".join(c.other_measurements)
        return f"{pair}: no sequence of commands tells them apart." + (f" Another measurement does: {other}." if other else "")
    if c.already:
        return f"{pair}: these measurements decide already; {_minutes(c.minutes)} of new ones would do so alone."
    beside = f" (plain random commands: {c.times_faster:.1f} times as long)" if c.times_faster > 1 else ""
    return f"{pair}: decided with a chance of {c.power:.0%}; nine in ten would be after {_minutes(c.minutes)}{beside}."


def _lines(p: Proposal, written: str) -> Iterator[str]:
    yield f"verdict so far: {p.verdict}; explanations to tell apart: {'; '.join(r.title for r in p.rivals)}"
    yield from (f"  {contest_text(c)}" for c in p.contests)
    if not len(p.plan):
        yield "No trial is proposed: no commands would decide anything."
        return
    a = p.arena
    yield (
        f"{len(p.plan)} trials of about {p.plan.lasting_s.mean():.0f} s, {p.plan.lasting_s.sum() / 60:.1f} min of driving, "
        f"inside x {a.x_low_m:.2f} to {a.x_high_m:.2f} m, y {a.y_low_m:.2f} to {a.y_high_m:.2f} m,"
    )
    yield (
        f"each from x = {a.start[0]:.2f} m, y = {a.start[1]:.2f} m, heading {np.degrees(a.start[2]):.0f}°; wheels "
        f"{p.bounds.slowest_m_s:.3g} to {p.bounds.fastest_m_s:.3g} m/s."
    )
    if written:
        yield f"written to {written}; drive it with: bns trial --robot khepera --rig RIG.yaml --commands {written}"
        yield "then: bns diagnose DATA --more NEW.csv --model M"


def _minutes(minutes: float) -> str:
    if minutes > 24 * 60:
        return "more than a day"
    return f"{minutes:.1f} min" if minutes < 120 else f"{minutes / 60:.1f} h"
