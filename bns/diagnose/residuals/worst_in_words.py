"""Trials that are unlike the rest, in words: what becomes of the verdict with and without them, and what would say why."""

from __future__ import annotations

from collections.abc import Sequence

from bns.diagnose.residuals.worst_trials import WithoutWorst
from bns.diagnose.settings import DEFAULTS

WORST_SHARE = DEFAULTS.residuals.worst_share
SHOWN = DEFAULTS.report.moments


def on_worst(both: WithoutWorst) -> str:
    """What becomes of a verdict with and without trials that are unlike the rest, how they are unlike, and what would say why."""
    one = len(both.trials) == 1
    counts, them = ("It does not count in the fits, but is", "it") if one else ("They do not count in the fits, but are", "them")
    known = {a.trial: f" ({a.in_words})" for a in both.apart[:SHOWN]}
    each = [f"{name}{known.get(name, '')}" for name in both.trials]
    those = f"trial {each[0]}" if one else f"trials {'; '.join(each) if known else ', '.join(each)}"
    verdict, effects = both.with_them
    other = f"{verdict} ({', '.join(effects)})" if effects else verdict
    said = f"the verdict is the same with {them}" if both.same else f"with {them} the verdict would be {other}"
    return (
        f"Unlike all others as a whole: {those}. {counts} part of the errors shown; {said}. {_causes(both)}`--without` excludes "
        f"{them}."
    )


def _causes(both: WithoutWorst) -> str:
    """Which causes are left of trials that are unlike the rest, and what tells them apart."""
    said = ""
    if any(a.once and not a.jumped for a in both.apart):
        said += (
            "One moment is a push, a slip, a cable that caught, a tracker that lost the robot, or a command that the log has at "
            "a wrong time: a film, or the logged commands of that moment, tells which. "
        )
    if any(not a.once for a in both.apart):
        said += (
            "The model lacks something, so a trial that differs throughout may be one in which this matters most. "
            if both.without[0] == "unlisted"
            else "A trial that differs throughout had another load, floor or start, or its commands are logged at wrong times or "
            "ask for what the model has least right: repeat it with the same commands. If it is off again, these tell why. "
        )
    return said


def on_many_apart(trials: Sequence[str]) -> str:
    """On trials that are unlike the rest and too many to be left out."""
    return (
        f"Unlike all others as a whole: trials {', '.join(trials)}. They are more than {WORST_SHARE:.0%} of all trials, so they "
        "count: what happened there may happen again. `--without` excludes them."
    )
