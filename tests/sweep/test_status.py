"""What status, plan and progress bar say."""

import io
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sweep_jobs
from sweep_jobs import make_sweep

from bns.errors import SpecError, StoreError, SweepWarning
from bns.spec import RunSpec
from bns.store.archive.write import archive
from bns.store.read.reader import load
from bns.store.record import RunRecord
from bns.sweep.expand.grid import parse_stored, parse_sweep
from bns.sweep.expand.order import ordered_specs
from bns.sweep.forecast.pace import Pace
from bns.sweep.forecast.plan import START_UP_S, plan, work
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.jobs.job import run_job
from bns.sweep.progress import SweepProgress, describe_rate
from bns.sweep.report import status_table, summed_up
from bns.sweep.runner import Summary, run_sweep
from bns.sweep.status import sweep_status

TEXT = """
name: {name}
robot: khepera
seeds: 2
fixed: {{evaluations: 3}}
grid: {{task: [circle, letter-s], population_size: [10, 11, 12]}}
"""


def costing(spec, iteration_s, pattern_s, patterns, controller_s, evaluation_s) -> RunRecord:
    """A run whose parts cost that much."""
    there = patterns * np.arange(1, spec.evaluations + 1)
    training = spec.training_iterations_per_evaluation * (iteration_s + pattern_s * there)
    evolution = np.full(len(there), controller_s * spec.population_size * (spec.generations_per_evaluation + 1))
    record = sweep_jobs.ok(spec, wall_s=float((training + evolution + evaluation_s).sum()))
    costs = {"training_patterns": there, "training_cpu_s": training, "evolution_cpu_s": evolution}
    return replace(record, tables={"evals": record.tables["evals"] | costs})


def sweep_of(tmp_path, name: str = "demo"):
    return parse_sweep(TEXT.format(name=name), tmp_path / "x.yaml")


def job(spec) -> RunRecord:
    record = sweep_jobs.ok(spec, wall_s=spec.population_size / 10)
    if spec.population_size == 12:
        return RunRecord(spec, {**record.run, "status": "failed", "error": "ValueError: twelve"})
    return record


def serial(sweep, results, **options) -> Summary:
    return run_sweep(sweep, results, job=job, executor=SerialExecutor(job), **options)


@pytest.fixture(autouse=True)
def tasks(monkeypatch):
    monkeypatch.setattr("bns.sweep.expand.grid.task_names", lambda _robot: ("circle", "letter-s"))


def test_status_counts_by_sweep_and_task_against_the_sweep_file(tmp_path):
    serial(sweep_of(tmp_path), tmp_path)
    serial(make_sweep("no-file", seeds=1), tmp_path)
    rows = sweep_status(tmp_path)
    assert [(r.sweep, r.task, r.done, r.failed, r.quarantined, r.total, r.remaining) for r in rows] == [
        ("demo", "circle", 4, 2, 0, 6, 0),
        ("demo", "letter-s", 4, 2, 0, 6, 0),
        ("no-file", "circle", 3, 1, 0, None, None),
    ]
    assert rows[0].mean_wall_s == pytest.approx(1.05)
    assert rows[0].last.tzinfo is not None


def test_runs_that_only_an_archive_has_count_as_the_sweep_counts_them(tmp_path):
    serial(sweep_of(tmp_path), tmp_path / "there", limit=5)
    archive(tmp_path / "there", tmp_path / "part.parquet")
    serial(sweep_of(tmp_path), tmp_path / "here", limit=2)
    before = sum(row.done + row.failed for row in sweep_status(tmp_path / "here"))
    (tmp_path / "here" / "archived").mkdir()
    (tmp_path / "part.parquet").rename(tmp_path / "here" / "archived" / "part.parquet")
    rows = sweep_status(tmp_path / "here")
    assert (before, sum(row.done + row.failed for row in rows)) == (2, 5)
    assert (sum(row.archived for row in rows), sum(row.remaining for row in rows)) == (3, 7)
    assert status_table(rows).splitlines()[0].endswith("archived")
    again = serial(sweep_of(tmp_path), tmp_path / "here")
    assert again.new == 7


def test_an_archive_alone_is_shown_as_well(tmp_path):
    serial(sweep_of(tmp_path), tmp_path / "there", limit=5)
    before = sweep_status(tmp_path / "there")
    archive(tmp_path / "there", tmp_path / "here" / "archived" / "part.parquet")
    rows = sweep_status(tmp_path / "here")
    assert [(r.sweep, r.task, r.done + r.failed, r.archived) for r in rows] == [
        (r.sweep, r.task, r.done + r.failed, r.done + r.failed) for r in before if r.done + r.failed
    ]
    assert all(r.total is None and r.last is None for r in rows)
    assert str(rows[0].archived) in status_table(rows).splitlines()[1].split()


def test_status_of_a_sweep_half_done(tmp_path):
    serial(sweep_of(tmp_path), tmp_path, limit=5)
    assert sum(row.remaining for row in sweep_status(tmp_path)) == 7


def test_tasks_and_sweeps_that_are_not_begun_are_listed(tmp_path):
    serial(sweep_of(tmp_path), tmp_path, limit=1)
    serial(sweep_of(tmp_path, "later"), tmp_path, limit=0)
    begun, *others = sorted(sweep_status(tmp_path), key=lambda row: row.last is None)
    assert (begun.sweep, begun.remaining, begun.done + begun.failed) == ("demo", 5, 1)
    assert {(row.sweep, row.total, row.remaining, row.other) for row in others} == {("demo", 6, 6, 0), ("later", 6, 6, 0)}
    lines = status_table([begun, *others]).splitlines()
    assert all(line.split()[2:] == ["0", "6", "0", "0", "0", "-", "-"] for line in lines[2:])


def test_a_sweep_whose_first_run_is_under_way_is_listed_alone(tmp_path):
    serial(sweep_of(tmp_path), tmp_path, limit=0)
    assert [(row.task, row.done, row.total) for row in sweep_status(tmp_path)] == [("circle", 0, 6), ("letter-s", 0, 6)]


def test_runs_of_an_earlier_file_of_that_name_are_counted_apart(tmp_path):
    serial(sweep_of(tmp_path), tmp_path)
    text = "name: demo\nrobot: khepera\nseeds: 1\nfixed: {evaluations: 3}\ngrid: {population_size: [10, 12, 13]}"
    with pytest.warns(SweepWarning):
        serial(parse_sweep(text, tmp_path / "y.yaml"), tmp_path, limit=0)
    rows = sweep_status(tmp_path)
    assert [(r.task, r.done, r.failed, r.other, r.total, r.remaining) for r in rows] == [
        ("circle", 1, 1, 4, 3, 1),
        ("letter-s", 0, 0, 6, 0, 0),
    ]
    assert rows[0].mean_wall_s == pytest.approx(1.0)
    lines = [line.split() for line in status_table(rows).splitlines()]
    assert lines[0][:7] == ["sweep", "task", "done", "of", "failed", "quarantined", "other"]
    assert [line[2:7] for line in lines[1:]] == [["1", "3", "1", "0", "4"], ["0", "0", "0", "0", "6"]]


@pytest.mark.filterwarnings("ignore::bns.errors.SweepWarning")  # as they should: the files take turns
def test_the_file_that_was_used_last_counts_even_if_it_was_used_before(tmp_path):
    text = "name: demo\nrobot: khepera\nfixed: {evaluations: 3}\ngrid: {population_size: [10, 13]}"
    first, second = sweep_of(tmp_path), parse_sweep(text, tmp_path / "y.yaml")
    for file, total in ((first, 6), (second, 2), (first, 6), (second, 2)):
        serial(file, tmp_path)
        assert next(row.total for row in sweep_status(tmp_path) if row.task == "circle") == total
    assert len(load(tmp_path, "specs")) == 2


def test_a_longer_file_of_that_name_has_no_others(tmp_path):
    serial(sweep_of(tmp_path), tmp_path)
    longer = parse_sweep(TEXT.format(name="demo").replace("seeds: 2", "seeds: 3"), tmp_path / "x.yaml")
    serial(longer, tmp_path, limit=0)
    assert [(r.done, r.failed, r.other, r.remaining) for r in sweep_status(tmp_path)] == [(4, 2, 0, 3)] * 2


def test_question_about_failures_asks_the_folder_they_are_in(tmp_path):
    text = summed_up(Summary("demo", 4, done=3, failed=1), Path("/data/my results"))
    assert "bns query --results '/data/my results' \"SELECT run_id, error FROM runs WHERE sweep = 'demo'" in text


def test_status_of_nothing_is_explained(tmp_path):
    with pytest.raises(StoreError, match="bns"):
        sweep_status(tmp_path)


def test_plan_from_stored_runs_is_their_mean(tmp_path):
    sweep = make_sweep(combos=2, seeds=4)
    serial(sweep, tmp_path, limit=4)  # both population sizes, seeds 0 and 1
    found = plan(sweep, tmp_path, 2, job=pytest.fail)
    assert (found.total, found.done, found.remaining) == (8, 4, 4)
    assert found.seconds_estimate == pytest.approx(START_UP_S + (2 * 1.0 + 2 * 1.1) / 2)
    assert found.basis == "the mean of 4 stored runs of this sweep"
    assert 100 < found.bytes_estimate < 1e6
    serial(sweep, tmp_path)
    done = plan(sweep, tmp_path, 2, job=pytest.fail)
    assert (done.remaining, done.seconds_estimate, done.bytes_estimate) == (0, 0.0, 0.0)


def test_plan_scales_population_sizes_that_were_never_run(tmp_path):
    serial(make_sweep(combos=1, seeds=1), tmp_path)
    sweep = make_sweep(combos=2, seeds=1)
    found = plan(sweep, tmp_path, 1, job=pytest.fail)
    assert "population sizes 11 have none and are scaled by work" in found.basis
    assert 0.9 < found.seconds_estimate < 1.2


def test_plan_without_results_times_one_short_run(tmp_path):
    calls = []

    def trial(spec):
        calls.append(spec)
        return costing(spec, iteration_s=1e-6, pattern_s=5e-8, patterns=6, controller_s=1e-6, evaluation_s=1e-3)

    sweep = make_sweep(combos=1, seeds=4, evaluations=100)
    found = plan(sweep, tmp_path / "none", 2, job=trial, warm_up=lambda: calls.append("warm"))
    assert [calls[0], calls[1].evaluations, len(calls)] == ["warm", 20, 2]
    assert found.basis == "the parts of one trial run of 20 evaluations (0.11 s)"
    # Training on 6, 12, ... 600 patterns, evolution of 10 controllers, the rest; four runs by two workers.
    assert found.seconds_estimate - START_UP_S == pytest.approx(2 * (1000 * (100 * 1e-6 + 30300 * 5e-8) + 100 * (210e-6 + 1e-3)))
    assert found.bytes_estimate == 4 * 100 * 100
    more = plan(sweep, tmp_path / "none", 64, job=trial)  # a run cannot be divided
    assert more.seconds_estimate - START_UP_S == pytest.approx((found.seconds_estimate - START_UP_S) / 2)
    assert not (tmp_path / "none").exists()


PARTS = {"iteration_s": 2e-6, "pattern_s": 4e-8, "patterns": 7.0, "controller_s": 5e-7, "evaluation_s": 8e-4}


@pytest.mark.parametrize(
    "changes",
    [{}, {"evaluations": 100}, {"population_size": 50, "generations_per_evaluation": 500},
     {"training_iterations_per_evaluation": 0}, {"training_iterations_per_evaluation": 9000, "evaluations": 3}],
)  # fmt: skip
def test_pace_of_one_run_foretells_runs_of_any_other_size(changes):
    other = RunSpec(**changes)
    wall_s = costing(other, **PARTS).run["wall_s"]
    assert Pace.of(costing(RunSpec(evaluations=20), **PARTS)).seconds(other) == pytest.approx(wall_s)


def test_an_estimate_is_the_sum_of_what_different_runs_cost(tmp_path):
    sweep = parse_sweep(
        "name: mixed\nrobot: khepera\nseeds: 2\nfixed: {evaluations: 40}\ngrid: {population_size: [20, 100, 400]}",
        tmp_path / "mixed.yaml",
    )
    takes_s = [costing(spec, **PARTS).run["wall_s"] for spec in ordered_specs(sweep)]
    assert len(takes_s) == 6
    assert max(takes_s) > 1.1 * min(takes_s)
    found = plan(sweep, tmp_path, 1, job=lambda spec: costing(spec, **PARTS), warm_up=lambda: None)
    assert found.seconds_estimate == pytest.approx(sum(takes_s))


def test_pace_of_a_run_that_shares_its_core_is_stretched():
    record = costing(RunSpec(evaluations=20), **PARTS)
    shared = replace(record, run={**record.run, "wall_s": 3 * record.run["wall_s"]})
    assert Pace.of(shared).seconds(RunSpec()) == pytest.approx(3 * Pace.of(record).seconds(RunSpec()))


@pytest.mark.parametrize("changes", [{"evaluations": 1}, {"training_iterations_per_evaluation": 0}, {"population_size": 1}])
def test_pace_can_be_taken_of_the_smallest_runs(changes):
    spec = RunSpec(**{"evaluations": 2, "population_size": 8, **changes})
    assert 0 < Pace.of(run_job(spec)).seconds(RunSpec()) < math.inf  # what a loaded machine takes is not known
    assert 0 < Pace.of(costing(spec, **PARTS)).seconds(RunSpec()) < 600


def test_plan_says_that_the_trial_failed(tmp_path):
    sweep = parse_sweep("name: demo\nrobot: khepera\nfixed: {population_size: 12}", tmp_path / "x.yaml")
    found = plan(sweep, tmp_path, 1, job=job, warm_up=lambda: None)
    assert math.isnan(found.seconds_estimate)
    assert found.basis.endswith("failed with ValueError: twelve")


def test_failed_runs_are_planned_only_on_request(tmp_path):
    sweep = make_sweep()
    serial(sweep, tmp_path)
    assert plan(sweep, tmp_path, 1).remaining == 0
    assert plan(sweep, tmp_path, 1, retry_failed=True).remaining == 2


def test_work_grows_with_everything_that_costs():
    base = make_sweep(combos=1, seeds=1)
    first = work(sweep_spec(base))
    for name in "evaluations", "population_size", "generations_per_evaluation":
        assert work(sweep_spec(base, **{name: 5000})) > first
    assert work(sweep_spec(base, training_iterations_per_evaluation=5000)) > first


def sweep_spec(sweep, **changes):
    from bns.spec import RunSpec

    return RunSpec(**{**sweep.combos[0], **changes})


def test_progress_bar_is_silent_in_a_file_and_speaks_to_a_terminal():
    quiet, loud = io.StringIO(), io.StringIO()
    loud.isatty = lambda: True
    for stream in (quiet, loud):
        with SweepProgress(stream) as bar:
            bar(Summary("demo", 8))
            bar(Summary("demo", 8, done=3, failed=1, new=4))
    assert quiet.getvalue() == ""
    assert "demo" in loud.getvalue()
    assert "4/8" in loud.getvalue()


def test_rate_and_time_to_go():
    summary = Summary("demo", 100, done=40, failed=2, quarantined=1, new=10)
    assert describe_rate(summary, 60.0) == "10.0/min, 0:05:42 to go, 3 failed"
    assert describe_rate(Summary("demo", 100), 0.0) == ""


TWICE = """
name: demo
robot: khepera
seeds: 2
fixed: {evaluations: 3}
grid: {population_size: [10, 11, 10], mutation_rate: [0.1, 0.1]}
"""


def test_a_stored_file_with_values_that_come_twice_is_read_as_it_was_run_with_one_warning(tmp_path):
    """Older versions took such files; a new one is refused."""
    with pytest.raises(SpecError, match="population_size has the value 10 twice"):
        parse_sweep(TWICE, tmp_path / "x.yaml")
    once = parse_sweep(TWICE.replace("10, 11, 10", "10, 11").replace("0.1, 0.1", "0.1"), tmp_path / "x.yaml")
    serial(replace(once, text=TWICE), tmp_path)
    with pytest.warns(SweepWarning, match=r"sweep 'demo' .* values twice \(population_size: 10, mutation_rate: 0.1\)") as said:
        rows = sweep_status(tmp_path)
    assert len(said) == 1
    assert [(row.task, row.done, row.total, row.remaining, row.other) for row in rows] == [("circle", 4, 4, 0, 0)]
    with pytest.warns(SweepWarning, match="values twice"):
        assert parse_stored(TWICE, "demo").combos == once.combos
