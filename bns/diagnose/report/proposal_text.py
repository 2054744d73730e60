"""A proposed experiment in words, for a terminal and for the report."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from bns.diagnose.design.proposal import ModelPair, Proposal
from bns.diagnose.select.indistinguishable import TIE_Z
from bns.robots.khepera import START

_NEEDLESS = (
    "No experiment is needed: these measurements tell all these explanations apart. What follows is optional; it would confirm "
    "that on new data."
)


def proposal_text(p: Proposal, written: str = "", command: Mapping[str, str] | None = None) -> str:
    """Who stands against whom, what the experiment would decide, and what to type next.

    ``written``: the file with the commands; ``command``: words (data, model) of the command line that the next ones repeat.
    """
    whose = "explanations compared" if _needless(p) else "explanations to tell apart"
    first = f"verdict so far: {p.verdict}; {whose}: {'; '.join(r.title for r in p.competing_models)}"
    return "\n".join([first, *proposal_lines(p), *_next(p, written, command or {"data": "LOG", "model": "--model MODEL"})])


def model_pair_text(c: ModelPair) -> str:
    """One sentence or two on one pair."""
    pair = f"{c.first} against {c.second}"
    if c.indistinguishable:
        other = "; or ".join(c.independent_measurements)
        return f"{pair}: no sequence of commands tells them apart." + (
            f" Another measurement can: {other}." if other else ""
        )
    if c.no_decision:
        return (
            f"{pair}: no decision is expected from so short an experiment: the difference is expected to be "
            f"{c.standard_errors:.1f} standard errors, and it takes {TIE_Z:g} to decide. For a probability of 90 % it takes "
            f"{_minutes(c.minutes)} of driving (--minutes)."
        )
    if c.already_decided:
        return f"{pair}: decided by these measurements already; {_minutes(c.minutes)} of new driving alone would also decide."
    beside = f" (random commands: {c.times_faster:.1f} times as long)" if c.times_faster > 1 else ""
    return f"{pair}: decided with a probability of {c.power:.0%}; for 90 % it takes {_minutes(c.minutes)} of driving{beside}."


def proposal_lines(p: Proposal) -> list[str]:
    """Whether an experiment is needed at all, a sentence a pair, then what the trials are."""
    lines = [_NEEDLESS] * _needless(p) + [model_pair_text(c) for c in p.model_pairs]
    if not len(p.plan):
        if any(c.no_decision for c in p.model_pairs):
            return [*lines, f"No trial is proposed: none is expected to decide in {p.minutes:g} min."]
        return [*lines, "No trial is proposed: no commands would decide."]
    a = p.arena
    if a is None or p.bounds is None:
        return [
            *lines,
            f"{len(p.plan)} trials are proposed, {p.plan.lasting_s.sum() / 60:.1f} min of driving: the most "
            "informative parts of what was driven before, each repeated separately.",
        ]
    return [
        *lines,
        f"{len(p.plan)} trials of about {p.plan.lasting_s.mean():.0f} s are proposed, {p.plan.lasting_s.sum() / 60:.1f} min of "
        f"driving, inside x {a.x_low_m:z.2f} to {a.x_high_m:z.2f} m, y {a.y_low_m:z.2f} to {a.y_high_m:z.2f} m, each from "
        f"x = {a.start[0]:z.2f} m, y = {a.start[1]:z.2f} m, heading {np.degrees(a.start[2]):z.0f}°; wheels "
        f"{p.bounds.slowest_m_s:.3g} to {p.bounds.fastest_m_s:.3g} m/s.",
    ]


def _needless(p: Proposal) -> bool:
    return bool(p.model_pairs) and all(c.already_decided for c in p.model_pairs)


def _next(p: Proposal, written: str, command: Mapping[str, str]) -> Iterator[str]:
    if not written:
        return
    data, model, file = command["data"], command.get("search", command["model"]), shlex.quote(written)
    optional = " (optional)" if _needless(p) else ""
    if p.bounds is None or not p.bounds.robot or p.arena is None:
        yield f"written to {written}; to go on{optional}, drive its trials and log them as before"
        yield f"then: bns diagnose {data} {model} --more NEW-LOG.csv"
        return
    if not np.allclose(p.arena.start, START, atol=0.02):
        limits = " ".join(filter(None, (f"--minutes {p.minutes:g}", command.get("area", ""), "--start=0,0,90")))
        yield f"for trials that start where those of bns trial do: bns propose {data} {model} {limits} -o {file}"
    yield f"written to {written}; to drive it{optional}: bns trial --robot {p.bounds.robot} --rig RIG.yaml --commands {file}"
    driven = f"results/trials/experiment-{Path(written).stem}/measurements.csv"
    yield f"then: bns diagnose {data} {model} --more {shlex.quote(driven)}"


def _minutes(minutes: float) -> str:
    if minutes > 24 * 60:
        return "more than a day"
    return f"{minutes:.1f} min" if minutes < 120 else f"{minutes / 60:.1f} h"
