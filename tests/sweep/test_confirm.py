"""The best combinations on fresh seeds: which they are, that they stay so, and that they are a sweep like any other."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import sweep_jobs

from bns.cli.main import main
from bns.errors import SpecError, StoreError, SweepWarning
from bns.store.read.reader import load
from bns.store.record import RunRecord
from bns.sweep.confirm import RANKED_BY, best, confirmation, in_turn
from bns.sweep.expand.grid import load_sweep, parse_sweep
from bns.sweep.expand.order import ordered_specs
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.runner import run_sweep
from bns.sweep.status import sweep_status

TEXT = """
name: demo
robot: khepera
seeds: 4
first_seed: 3
fixed: {evaluations: 3}
grid: {task: [circle, infinity], population_size: [10, 11, 12, 13], mutation_rate: [0.1, 0.3]}
"""
REAL = """
name: little
robot: khepera
seeds: 2
fixed: {evaluations: 2, generations_per_evaluation: 1, training_iterations_per_evaluation: 10}
grid: {population_size: [8, 12], mutation_rate: [0.1, 0.9]}
"""


@pytest.fixture
def sweep(tmp_path):
    return parse_sweep(TEXT, tmp_path / "demo.yaml")


def carried_out(sweep, results, job=sweep_jobs.ok, **options):
    return run_sweep(sweep, results, job=job, executor=SerialExecutor(job), **options)


def values(spec, **columns) -> RunRecord:
    """A run whose last evaluation has these values, and whose others have the opposite."""
    record = sweep_jobs.ok(spec)
    evals = dict(record.tables["evals"])
    for name in RANKED_BY:
        kind = evals[name].dtype
        evals[name] = np.array([1, 1, columns.get(name, 0)]).astype(kind)
    return replace(record, tables={"evals": evals})


def luck(spec) -> RunRecord:
    """Success at 7 cm decides; between its equals 14 cm; and between those the fitness in the world."""
    return values(
        spec,
        success=spec.population_size == 12 or (spec.population_size == 11 and spec.seed == 3),
        success_14cm=spec.population_size == 13,
        fitness_world=spec.mutation_rate,
    )


def named(combos):
    return [(combo["task"], combo["population_size"], combo["mutation_rate"]) for combo in combos]


def test_the_best_of_each_task_come_in_the_order_of_the_source(sweep, tmp_path):
    carried_out(sweep, tmp_path, luck)
    ranking = [(12, 0.3), (12, 0.1), (11, 0.3), (11, 0.1), (13, 0.3), (13, 0.1), (10, 0.3), (10, 0.1)]
    for top in (1, 5, 8, 99):
        expected = [(task, *one) for task in ("circle", "infinity") for one in ranking[:top]]
        assert named(best(sweep, tmp_path, top)) == expected


def test_equals_stand_in_the_order_of_the_file(sweep, tmp_path):
    carried_out(sweep, tmp_path, values)
    assert named(best(sweep, tmp_path, 2)) == [
        (task, 10, rate) for task in ("circle", "infinity") for rate in (0.1, 0.3)
    ]


def test_successes_by_distance_that_a_robot_does_not_have_decide_nothing(sweep, tmp_path):
    def snake(spec):
        record = luck(spec)
        unknown = {name: np.array([None] * 3) for name in record.tables["evals"] if name.endswith("cm")}
        return replace(record, tables={"evals": {**record.tables["evals"], **unknown}})

    carried_out(sweep, tmp_path, snake)
    assert named(best(sweep, tmp_path, 8))[4:8] == [("circle", size, rate) for rate in (0.3, 0.1) for size in (10, 13)]


def test_runs_that_failed_and_runs_of_an_earlier_file_have_no_say(sweep, tmp_path):
    def lost(spec):
        record = values(spec, success=1)
        failed = {**record.run, "status": "failed", "error": "ValueError: no"}
        return RunRecord(spec, failed) if spec.population_size == 10 and spec.seed > 3 else luck(spec)

    carried_out(replace(sweep, first_seed=50), tmp_path, lambda spec: values(spec, success=spec.population_size == 13))
    with pytest.warns(SweepWarning, match="already holds"):
        carried_out(sweep, tmp_path, lost)
    assert named(best(sweep, tmp_path, 1)) == [("circle", 12, 0.3), ("infinity", 12, 0.3)]


def test_the_last_evaluation_is_that_of_each_run_however_short(tmp_path):
    sweep = parse_sweep("{name: mixed, robot: khepera, seeds: 2, grid: {evaluations: [2, 3]}}", tmp_path / "mixed.yaml")
    carried_out(sweep, tmp_path)
    assert sorted(combo["evaluations"] for combo in best(sweep, tmp_path, 2)) == [2, 3]


def test_a_confirmation_has_the_same_runs_on_seeds_beyond_those_of_the_file(sweep, tmp_path):
    carried_out(sweep, tmp_path, luck)
    more = confirmation(sweep, tmp_path, 3)
    assert (more.name, more.robot, more.all_seeds, more.total) == ("demo-confirm", "khepera", range(7, 11), 24)
    chosen = best(sweep, tmp_path, 3)
    swept = {replace(spec, seed=0) for spec in ordered_specs(sweep)}
    assert {replace(spec, seed=0) for spec in ordered_specs(more)} < swept
    assert {spec.population_size for spec in ordered_specs(more)} == {c["population_size"] for c in chosen} == {11, 12}
    assert {spec.seed for spec in ordered_specs(more)}.isdisjoint(spec.seed for spec in ordered_specs(sweep))


def test_it_is_resumed_and_listed_like_any_sweep_and_its_results_do_not_change_the_choice(sweep, tmp_path):
    carried_out(sweep, tmp_path, luck)
    first = carried_out(confirmation(sweep, tmp_path, 2), tmp_path, values, limit=5)
    again = carried_out(confirmation(sweep, tmp_path, 2), tmp_path, values)
    assert (first.new, first.stopped_by, again.new, again.done) == (5, "limit", 11, 16)
    rows = {(row.sweep, row.task): (row.done, row.total, row.other) for row in sweep_status(tmp_path)}
    assert rows["demo-confirm", "circle"] == rows["demo-confirm", "infinity"] == (8, 8, 0)
    wider = confirmation(sweep, tmp_path, 3)
    assert carried_out(wider, tmp_path).new == 8  # the two that were confirmed are among the three


def test_a_sweep_with_runs_to_do_is_not_confirmed_yet(sweep, tmp_path):
    carried_out(sweep, tmp_path, luck, limit=sweep.total - 1)
    assert confirmation(sweep, tmp_path, 3) is None
    with pytest.warns(SweepWarning, match="demo is confirmed when all of its runs are done"):
        assert list(in_turn([sweep], tmp_path, 3)) == [sweep]
    assert list(in_turn([sweep], tmp_path, None)) == [sweep]


def test_where_nothing_went_well_nothing_is_best(sweep, tmp_path):
    def never(spec):
        return RunRecord(spec, {**sweep_jobs.ok(spec).run, "status": "failed", "error": "ValueError: no"})

    carried_out(sweep, tmp_path, never)
    with pytest.raises(StoreError, match=r"no run of sweep 'demo' .* went well.*--retry-failed"):
        confirmation(sweep, tmp_path, 3)


def test_a_name_that_leaves_no_room_is_refused(sweep, tmp_path):
    long = replace(sweep, name="n" * 75)
    carried_out(long, tmp_path, luck)
    with pytest.raises(SpecError, match="name has 83 characters; it may have 80 at most"):
        confirmation(long, tmp_path, 1)


@pytest.mark.filterwarnings("always::bns.errors.SweepWarning")
def test_from_the_command_line_twice_and_dry(tmp_path, capsys):
    file, results = tmp_path / "little.yaml", tmp_path / "results"
    file.write_text(REAL)
    command = ["sweep", str(file), "--confirm-top", "2", "--jobs", "1", "--results", str(results)]
    assert main([*command, "--dry-run"]) == 0
    out, err = capsys.readouterr()
    assert "little: 8 runs, 0 done" in out
    assert "little is confirmed when all of its runs are done" in err
    assert main(command) == 0
    assert "little-confirm: 4 runs now, 4 of 4 done" in capsys.readouterr().err
    before = load(results)
    assert main(command) == 0
    assert "little-confirm: 0 runs now, 4 of 4 done" in capsys.readouterr().err
    pd.testing.assert_frame_equal(load(results), before)
    chosen = {(combo["population_size"], combo["mutation_rate"]) for combo in best(load_sweep(file), results, 2)}
    confirmed = load(results, where={"sweep": "little-confirm"})
    assert set(zip(confirmed["population_size"], confirmed["mutation_rate"], strict=True)) == chosen
    assert set(confirmed["seed"]) == {2, 3}
