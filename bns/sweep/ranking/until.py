"""`--until ranking`: rounds of runs on any executor until the best combinations of each task are known; and the report."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bns.errors import SpecError
from bns.sweep.confirm import best
from bns.sweep.executors import Backend
from bns.sweep.expand.grid import Sweep
from bns.sweep.ranking.confidence import confidences
from bns.sweep.ranking.race import Aim, possible
from bns.sweep.ranking.stored import BEST, USUAL, Race, results_of
from bns.sweep.request import Request
from bns.sweep.runner import Summary

DECIDED = "ranking"
"""What stops a sweep whose best are known."""
_SAME = 1e-9


@dataclass(frozen=True)
class Ranked:
    """One of the best: place from 1, parameters, mean success over all seeds, confidence that it is one of them.

    ``ties``: how many combinations that are left out have all of their runs and the same success.
    """

    task: str
    place: int
    combination: dict[str, Any]
    success: float
    confidence: float
    ties: int = 0


@dataclass(frozen=True)
class Ranking:
    """The best of each task so far; ``open``: combinations that may still be among them; runs done, and of the whole sweep."""

    best: tuple[Ranked, ...]
    open: int
    runs: int
    total: int
    aim: Aim = USUAL

    @property
    def saved(self) -> float:
        """The part of the sweep that was not run."""
        return 1.0 - self.runs / self.total

    def in_words(self) -> str:
        """A table, and what was saved or is still to do."""
        head = f"{'task':12} {'place':>5} {'success':>8} {'confidence':>10}  combination"
        lines = [head if self.best else "no combination has all of its runs yet, so none is ranked"]
        for one in self.best:
            told = ", ".join(f"{name} {value}" for name, value in one.combination.items() if name != "task")
            sure = "tie" if one.ties else f"{one.confidence:.1%}"
            lines.append(f"{one.task:12} {one.place:5} {one.success:8.3f} {sure:>10}  {told}")
        ties = list(self._ties())
        state = "decided but for ties" if ties else "decided"
        state = state if not self.open else f"not decided: {self.open} more combinations may be among them"
        sure = "for certain" if self.aim.confidence == 1.0 else f"at {self.aim.confidence:.4g} confidence for each task"
        lines.append(f"the {BEST} best of each task are {state} ({sure})")
        lines[-1] += f"; {self.runs} of {self.total} runs" + (" so far" if self.open else f", {self.saved:.0%} saved")
        if self.aim.within:
            lines.append(f"what is left out may be better than the last of them by less than {self.aim.within:g} of mean success")
        lines += ties
        return "\n".join(lines)


    def _ties(self) -> Iterator[str]:
        """Of each task, in words: which places combinations that are left out could have as well."""
        for task in dict.fromkeys(one.task for one in self.best):
            level = [one for one in self.best if one.task == task and one.ties]
            if not level:
                continue
            first, last, more = level[0].place, level[-1].place, level[0].ties
            places = f"place {first} ties" if first == last else f"places {first} to {last} tie"
            others = "1 more combination" if more == 1 else f"{more} more combinations"
            has = "has" if more == 1 else "have"
            yield (
                f"{task}: {places}: {others} {has} the same success ({level[0].success:.3f}); among equals the success at larger "
                "distances, then the fitness in the world, then the order of the file chose"
            )


def run_until_ranked(
    backend: Backend, sweep: Sweep, request: Request, *, confidence: float = Aim.confidence, within: float = Aim.within
) -> tuple[Summary, Ranking]:
    """Carry out rounds until the best combinations are known, or the budget or a signal ends it.

    ``confidence`` that the best of a task are those of the complete sweep, 1 for certain; ``within``: what is left out may
    be better than the last of them by less than this mean success.

    Raises:
        SpecError: only one shard is to be done, or ``confidence`` or ``within`` cannot be.
    """
    if request.shard is not None:
        raise SpecError("--until ranking decides by the results of all runs; leave --shard out, or give --executor slurm.")
    aim = _aim(confidence, within)
    race, tried, new, new_failed = Race(sweep, aim), set[str](), 0, 0
    while True:
        stored, success = results_of(request.results, sweep.name)
        failed = {run for run, status in stored.items() if status != "ok"} if request.retry_failed else set()
        missing = race.todo(stored, success, failed - tried)
        now = _counted(sweep, race, stored, new, new_failed)
        if not missing:
            return replace(now, stopped_by=DECIDED if now.remaining else None), ranking(race, request.results, now)
        tried |= {race.run_id(number, seed) for number, seed in missing}
        part = replace(sweep, chosen=tuple(missing))
        summary = backend.carry_out(part, replace(request, wait=True, on_progress=_whole(request, now)))
        new, new_failed = new + summary.new, new_failed + summary.new_failed
        if summary.stopped_by is not None:
            stored, _ = results_of(request.results, sweep.name)
            stopped = replace(_counted(sweep, race, stored, new, new_failed), stopped_by=summary.stopped_by)
            return stopped, ranking(race, request.results, stopped)


def ranking(race: Race, folder: Path, counts: Summary) -> Ranking:
    """The best of the combinations that have all of their runs, by the rules of a whole sweep's ranking.

    ``counts``: runs that have a result, those of a round that was cut short included.
    """
    found: list[Ranked] = []
    whole = race.whole()
    chosen = best(race.sweep, folder, BEST, whole) if whole else []
    for task, numbers in race.tasks.items():
        results = race.results[task]
        own = [race.sweep.combos.index(combo) for combo in chosen]
        places = [numbers.index(number) for number in own if number in numbers]
        sure, (mean, _) = confidences(results, places, race.aim), results.bounds()
        level = np.abs(mean - mean[places[-1]]) < _SAME if places else np.zeros(len(mean), bool)
        ties = int((level & results.whole).sum() - level[places].sum())
        for at, (place, confidence) in enumerate(zip(places, sure, strict=True), 1):
            ranked = Ranked(task, at, race.sweep.combos[numbers[place]], float(mean[place]), confidence)
            found.append(replace(ranked, ties=ties) if level[place] else ranked)
    left = sum(int((possible(results, race.aim) & ~results.whole).sum()) for results in race.results.values())
    return Ranking(tuple(found), left, counts.total - counts.remaining, race.sweep.described, race.aim)


def _aim(confidence: float, within: float) -> Aim:
    if not 0.5 <= confidence <= 1.0:
        raise SpecError(f"confidence is a number from 0.5 to 1 (1: for certain), not {confidence}")
    if not 0.0 <= within < 1.0:
        raise SpecError(f"within is a difference of mean success, a number from 0 to less than 1, not {within}")
    return Aim(BEST, confidence, within)


def _counted(sweep: Sweep, race: Race, stored: dict[str, str], new: int, new_failed: int) -> Summary:
    known = [stored[run] for run in race.asked() if run in stored]
    done, failed, quarantined = (known.count(status) for status in ("ok", "failed", "quarantined"))
    return Summary(sweep.name, sweep.described, done, failed, quarantined, new, new_failed)


def _whole(request: Request, before: Summary) -> Callable[[Summary], None]:
    """Progress of a round, told as that of the whole sweep."""

    def told(part: Summary) -> None:
        request.on_progress(
            replace(
                before,
                done=before.done + part.done,
                failed=before.failed + part.failed,
                quarantined=before.quarantined + part.quarantined,
                new=before.new + part.new,
                new_failed=before.new_failed + part.new_failed,
            )
        )

    return told
