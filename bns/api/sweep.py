"""`bns.Sweep`: many runs, as a sweep file describes them, in Python."""

from __future__ import annotations

import dataclasses
import numbers
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from bns.api.common.progress import Progress, silent
from bns.api.common.shown import Shown, counted, plain
from bns.errors import SpecError, unknown_name
from bns.sweep.budget import Budget
from bns.sweep.confirm import confirmation
from bns.sweep.executors import load_executor
from bns.sweep.expand.grid import Sweep as Described
from bns.sweep.expand.grid import load_sweep, parse_sweep
from bns.sweep.expand.shard import Shard
from bns.sweep.forecast.plan import Plan
from bns.sweep.forecast.plan import plan as forecast
from bns.sweep.ranking.until import DECIDED, Ranking, run_until_ranked
from bns.sweep.report import planned, summed_up
from bns.sweep.request import Placement, Request
from bns.sweep.runner import Summary
from bns.sweep.status import SweepRow, sweep_status

_Path = str | PathLike[str]
Combos = Mapping[str, Sequence[Any]]
_WHERE = "of the sweep"


@dataclass(frozen=True, repr=False)
class SweepResult(Shown):
    """The state of a sweep after `Sweep.run`. ``counts``: total, done, failed, quarantined, new, new_failed, stopped_by."""

    counts: Summary
    results: Path
    ranking: Ranking | None = None
    """With ``until="ranking"``: the best of each task, each with its confidence; how many runs were saved."""

    @property
    def done(self) -> int:
        """Number of successful runs, those of earlier calls included."""
        return self.counts.done

    @property
    def finished(self) -> bool:
        """Whether every run has a result, good or bad, or the missing ones cannot change the requested ranking."""
        return self.counts.remaining == 0 or self.counts.stopped_by == DECIDED

    def load(self, table: str = "evals") -> pd.DataFrame:
        """The rows of this sweep, as `bns.load` gives them."""
        from bns.store.read.reader import load  # noqa: PLC0415  # only who looks waits for the reader

        return load(self.results, table, where={"sweep": self.counts.sweep})

    def summary(self) -> str:
        """The state of the sweep, and how to continue."""
        ranking = "" if self.ranking is None else f"{self.ranking.in_words()}\n"
        return ranking + summed_up(self.counts, self.results)

    def _line(self) -> str:
        c = self.counts
        lost = f", {c.failed} failed, {c.quarantined} quarantined" if c.failed or c.quarantined else ""
        return f"{c.sweep}, {c.done} of {c.total} done ({c.new} now){lost}, in {self.results}"


@dataclass(frozen=True, repr=False)
class SweepPlan(Shown):
    """What a sweep would take; ``plan``: total, done, remaining, seconds_estimate, bytes_estimate, basis."""

    plan: Plan
    place: Placement

    def summary(self) -> str:
        """Runs, time and disk."""
        return planned(self.plan, self.place)

    def _line(self) -> str:
        p = self.plan
        return f"{p.sweep}, {counted(p.total, 'run')}, {p.done} done, about {p.seconds_estimate:.0f} s with {self.place.where}"


class Sweep(Shown):
    """Runs of every combination of parameters, on several seeds.

    Args:
        name: under which the store keeps the runs; letters, digits, - and _.
        robot: khepera or snake, with options (snake+changes).
        grid: parameter -> its values; the product of all.
        zip: parameter -> its values, first with first, second with second; combined with the grid.
        sample: combinations drawn from ranges, combined with the grid: ``{"lhs": 40, "ranges": {"mutation_rate": [0.02,
            0.3]}}``; in place of lhs: sobol, random.
        fixed: parameter -> the one value.
        exclude: combinations of the product with all these values are left out.
        include: further combinations, on top of ``fixed``.
        seeds: how many, from ``first_seed`` on.

    Parameters are those of `bns.run`, without robot and seed. The same combination is the same run, with the same name and
    numbers, as in a sweep file (YAML).

    Raises:
        SpecError: what is not allowed, and what is.
    """

    def __init__(
        self,
        name: str,
        robot: str,
        *,
        grid: Combos | None = None,
        zip: Combos | None = None,
        sample: Mapping[str, Any] | None = None,
        fixed: Mapping[str, Any] | None = None,
        exclude: Iterable[Mapping[str, Any]] | None = None,
        include: Iterable[Mapping[str, Any]] | None = None,
        seeds: int = 1,
        first_seed: int = 0,
    ) -> None:
        tree: dict[str, Any] = {"name": name, "robot": robot, "seeds": seeds, "first_seed": first_seed}
        parts = {"fixed": fixed, "grid": grid, "zip": zip, "sample": sample, "exclude": exclude, "include": include}
        tree |= {key: _plain_part(part) for key, part in parts.items() if part is not None}
        self._described = _parsed(tree)

    @classmethod
    def from_file(cls, path: _Path) -> Sweep:
        """The sweep of a file; SpecError that begins with ``file:line:`` for whatever is wrong in it."""
        return cls._of(load_sweep(Path(path)))

    @classmethod
    def _of(cls, described: Described) -> Sweep:
        sweep = cls.__new__(cls)
        sweep._described = described
        return sweep

    @property
    def name(self) -> str:
        """Under which the store keeps the runs."""
        return self._described.name

    @property
    def combinations(self) -> pd.DataFrame:
        """One row per combination, one column per parameter that is given."""
        return pd.DataFrame(list(self._described.combos))

    @property
    def described(self) -> Described:
        """The same for the library's own functions."""
        return self._described

    def __len__(self) -> int:
        """How many runs."""
        return self._described.total

    def to_yaml(self) -> str:
        """The text of a sweep file that describes the same runs."""
        return self._described.text

    def run(
        self,
        results: _Path,
        *,
        jobs: int | None = None,
        device: str = "cpu",
        executor: str | None = None,
        scheduler: str | None = None,
        shard: tuple[int, int] | None = None,
        budget_s: float | None = None,
        until: str | None = None,
        confidence: float | None = None,
        within: float | None = None,
        retry_failed: bool = False,
        progress: Progress | None = None,
    ) -> SweepResult:
        """Carry out the runs that have no result yet, so that an interrupted sweep continues where it stopped.

        Args:
            results: folder of all results.
            jobs: worker processes (default: one per core).
            device: cpu, or cuda for the GPU of this machine.
            executor: joblib (default), dask or slurm; ``scheduler``: address of a Dask scheduler.
            shard: (k, n): only the k-th (from 1) of n parts.
            budget_s: stop after this time, s.
            until: "ranking": stop when the ten best combinations of each task are known; ``.ranking`` holds them.
            confidence: with ``until``: that they are those of the whole sweep, for each task (default 0.95; 1: for certain).
            within: with ``until``: what is left out may be better than the last of them by less than this (default 0).
            retry_failed: repeat failed and quarantined runs.
            progress: called with the fraction done and a text.

        Raises:
            StoreError: the results cannot be written, or another process writes this sweep.
            SpecError: options that exclude each other or cannot be. ClusterError, DeviceError: machines that cannot be used.
        """
        told, jobs = progress or silent, _checked_jobs(jobs)
        share = None if shard is None else Shard.parse(f"{shard[0]}/{shard[1]}")
        request = Request(
            results=Path(results),
            jobs=jobs,
            budget=Budget(budget_s),
            retry_failed=retry_failed,
            shard=share,
            on_progress=lambda at: told((at.total - at.remaining) / max(at.total, 1), f"{at.done} of {at.total} runs"),
            scheduler=scheduler,
        )
        way = load_executor(_way(device, executor, jobs))
        asked = {name: value for name, value in (("confidence", confidence), ("within", within)) if value is not None}
        if until is None and asked:
            raise SpecError(f"{' and '.join(asked)} belong to until=\"ranking\"")
        if until is not None:
            if until != "ranking":
                raise SpecError(unknown_name("end of a sweep", until, ["ranking"]))
            counts, ranking = run_until_ranked(way, self._described, request, **asked)
            return SweepResult(counts, Path(results), ranking)
        return SweepResult(way.carry_out(self._described, request), Path(results))

    def plan(self, results: _Path = "results", *, jobs: int | None = None) -> SweepPlan:
        """What is left to do and what it would take; nothing is written. Without stored runs one short run is timed."""
        place = load_executor("joblib").placement(Request(results=Path(results), jobs=_checked_jobs(jobs)))
        return SweepPlan(forecast(self._described, Path(results), place.workers), place)

    def status(self, results: _Path = "results") -> pd.DataFrame:
        """One row per task: sweep, task, done, failed, quarantined, total, remaining, mean_wall_s (s), last (start of a run)."""
        rows = [row for row in sweep_status(Path(results)) if row.sweep == self.name]
        fields = [field.name for field in dataclasses.fields(SweepRow)]
        table = pd.DataFrame([dataclasses.asdict(row) for row in rows], columns=fields)
        table["remaining"] = [row.remaining for row in rows]
        return table

    def confirmation(self, results: _Path, top: int) -> Sweep | None:
        """The ``top`` best combinations of each task on as many fresh seeds; None while runs of this sweep are missing."""
        more = confirmation(self._described, Path(results), top)
        return None if more is None else Sweep._of(more)

    def summary(self) -> str:
        """The sweep file."""
        return f"{self._line()}\n\n{self.to_yaml()}"

    def _line(self) -> str:
        d = self._described
        tasks = ", ".join(d.runs_by_task())
        many = f"{counted(len(d.combos), 'combination')} on {counted(d.seeds, 'seed')}, {counted(d.total, 'run')}"
        return f"{d.name}: {d.robot}, {tasks}; {many}"


def _checked_jobs(jobs: Any) -> int | None:
    """How many processes, as the command line takes them; SpecError for anything else."""
    if jobs is None:
        return None
    if isinstance(jobs, bool) or not isinstance(jobs, numbers.Integral) or jobs < 1:
        raise SpecError(f"jobs is {jobs!r}; it must be a whole number of 1 or more, or None for one per core.")
    return int(jobs)


def _parsed(tree: dict[str, Any]) -> Described:
    """The sweep of plain values, read as a file would be; complaints name no file."""
    where = Path(_WHERE)
    try:
        text = yaml.safe_dump(tree, sort_keys=False, allow_unicode=True)
        return parse_sweep(text, where)
    except yaml.YAMLError as fault:
        raise SpecError(
            f"A sweep consists of numbers, texts and lists; something else was given: {fault}."
        ) from fault
    except SpecError as fault:
        raise SpecError(re.sub(rf"^{_WHERE}:\d+: ", "", str(fault))) from None


def _plain_part(part: Any) -> Any:
    """A mapping or a list of mappings, of plain values."""
    return plain(dict(part)) if isinstance(part, Mapping) else [plain(dict(each)) for each in part]


def _way(device: str, executor: str | None, jobs: int | None) -> str:
    """Name of the executor; SpecError if a GPU and other machines are asked for at once."""
    if device == "cpu":
        return executor or "joblib"
    if executor not in {None, device} or jobs is not None:
        raise SpecError(
            f"The device {device} is the GPU of this machine; leave out jobs and executor, or take device='cpu'."
        )
    return device
