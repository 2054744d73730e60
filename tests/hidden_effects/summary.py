"""The table: shares with Wilson intervals, beside what is to be reached."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from statsmodels.stats.proportion import proportion_confint

from tests.hidden_effects.judge import ABSTAINED, RIGHT, WRONG, Coverage
from tests.hidden_effects.world import World


@dataclass(frozen=True)
class Result:
    """One judged world."""

    world: World
    outcome: str
    said: str
    seconds_s: float
    covered: tuple[Coverage, ...] = ()
    ratios: dict[str, float] | None = None
    cpu_s: float = 0.0


TARGETS = {
    "single": ("single effects", 0.95),
    "pair": ("pairs: both, nothing else", 0.90),
    "none": ("nothing hidden: none", 0.95),
    "unlisted": ("unlisted recognised", 0.90),
    "tie": ("confusable sets as ties", 1.00),
    "single-hard": ("single, harder conditions", None),
    "new": ("the longer list, one each", 0.90),
    "removed": ("... taken out: unlisted", 0.90),
    "triple": ("three at once, nothing else", 0.85),
    "size": ("other sizes, rates, noise", 0.85),
}
COVERAGE, ERROR_RATIO, SECONDS_S = 0.90, 1.05, 60.0
SILENT = {"none", "insufficient-data", "no answer"}
HARDER = {
    "20-trials": "20 trials",
    "ends": "poses at ends of commands",
    "coarse": "3 mm camera",
    "fine": "0.5 mm camera, 0.2 % jitter",
    "wide": "wide robot",
}


def table(results: Sequence[Result]) -> str:
    """Everything in lines."""
    lines = [f"{'':28s} {'worlds':>6s} {'right':>6s} {'abst.':>6s} {'wrong':>6s}   share (95 %)          target"]
    for family, (title, target) in TARGETS.items():
        lines += _row(title, [one for one in results if one.world.family == family], target)
    for word, title in HARDER.items():
        of = [one for one in results if one.world.family == "single-hard" and one.world.name.endswith(word)]
        lines += _row("  " + title, of, None)
    return "\n".join([*lines, *_alarms(results), *_coverage(results), *_errors(results), *_seconds(results)])


def _row(title: str, of: Sequence[Result], target: float | None) -> list[str]:
    if not of:
        return []
    right, abstained, wrong = (sum(one.outcome == kind for one in of) for kind in (RIGHT, ABSTAINED, WRONG))
    share = _share(right, len(of))
    counts = f"{len(of):6d} {right:6d} {abstained:6d} {wrong:6d}"
    return [f"{title:28s} {counts}   {share}  {_against(right / len(of), target)}".rstrip()]


def _share(successes: int, of: int) -> str:
    low, high = proportion_confint(successes, of, alpha=0.05, method="wilson")
    return f"{successes / of:4.0%} ({low:4.0%} - {high:4.0%})"


def _against(share: float, target: float | None) -> str:
    if target is None:
        return ""
    return f">= {target:.0%} {'met' if share >= target else 'NOT met'}"


def _alarms(results: Sequence[Result]) -> list[str]:
    """A cause, known or unknown, where there is none."""
    of = [one for one in results if one.world.family == "none"]
    if not of:
        return []
    false = sum(one.said not in SILENT for one in of)
    met = "met" if false / len(of) <= 0.05 else "NOT met"
    return [f"false alarms                 {false} of {len(of)}: {_share(false, len(of))}  <= 5% {met}"]


def _coverage(results: Iterable[Result]) -> list[str]:
    intervals = [interval for one in results for interval in one.covered]
    if not intervals:
        return []
    inside = sum(interval.inside for interval in intervals)
    share = _share(inside, len(intervals))
    return [
        f"true value in 95 % interval  {inside} of {len(intervals)}: {share}  "
        f"{_against(inside / len(intervals), COVERAGE)}"
    ]


def _errors(results: Iterable[Result]) -> list[str]:
    found = [one.ratios for one in results if one.ratios and one.outcome == RIGHT]
    lines = []
    for horizon in found[0] if found else ():
        ratios = np.array([ratio[horizon] for ratio in found])
        met = "met" if np.median(ratios) <= ERROR_RATIO else "NOT met"
        within = _share(int(np.sum(ratios <= ERROR_RATIO)), len(ratios))
        lines.append(
            f"error / true model's, {horizon:11s} median {np.median(ratios):.3f}, worst {ratios.max():.3f}; "
            f"<= {ERROR_RATIO} in {within}  median {met}"
        )
    return lines


def _seconds(results: Sequence[Result]) -> list[str]:
    """Worlds are asked side by side, each on its share of the cores."""
    taken, worked = (np.array([value(one) for one in results]) for value in (lambda r: r.seconds_s, lambda r: r.cpu_s))
    if not len(taken):
        return []
    met = "met" if taken.max() <= SECONDS_S else "NOT met"
    lines = [f"seconds a world              median {np.median(taken):.1f}, longest {taken.max():.1f}  <= {SECONDS_S:.0f} {met}"]
    return [*lines, f"... of CPU                   median {np.median(worked):.1f}, most {worked.max():.1f}"]


def mistakes(results: Sequence[Result]) -> str:
    """One line a world that was not right."""
    return "\n".join(
        f"  {one.outcome:9s} {one.world.name}: said {one.said}" for one in results if one.outcome != RIGHT
    )
