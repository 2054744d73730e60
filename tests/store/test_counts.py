"""Files without a digest that have lost rows: the runs are done again, whichever table it was, and nothing is doubled."""

import itertools
import warnings

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from bns.registry import APPROACHES
from bns.spec import RunSpec
from bns.store import StoreWarning, Writer, compact, finished, load
from bns.store.record import RunRecord
from bns.store.schema import RECORDED, SCHEMA_VERSION
from bns.sweep.status import sweep_status

from .synthetic import columns, record, run_row, specs
from .test_damage import files, with_version

TABLES = ("runs", *RECORDED)
EVALUATIONS, BRED, PROBES = 3, 2, 4


@pytest.fixture(autouse=True)
def no_waiting_for_the_disk(monkeypatch):
    """What it is for is tested in test_order.py."""
    monkeypatch.setattr("os.fsync", lambda _: None)


def recorded(spec, numbers):
    """A run with everything that one records, whose fittest's drives ended early and whose breeding began late."""
    random = np.random.default_rng(spec.seed + spec.population_size)
    commands = [1 + number % 3 for number in range(len(numbers))]
    ends = list(itertools.chain(*(((n, "evaluated", c + 1), (n, "fittest", c)) for n, c in zip(numbers, commands, strict=True))))
    made = {
        "evals": {"evaluation": numbers, "commands": commands, "generations": BRED * np.arange(len(numbers))},
        "paths": {
            "evaluation": [number for number, _, steps in ends for _ in range(steps)],
            "who": np.array([who for _, who, steps in ends for _ in range(steps)], object),
            "step": [step for _, _, steps in ends for step in range(steps)],
        },
        "probes": {"evaluation": np.repeat(numbers, PROBES), "probe": np.tile(np.arange(PROBES), len(numbers))},
        "generations": {
            "evaluation": np.repeat(numbers[1:], BRED),
            "generation": 1 + np.arange(BRED * (len(numbers) - 1)),
        },
    }
    filled = {
        name: columns(name, len(own["evaluation"]), random) | {key: np.asarray(values) for key, values in own.items()}
        for name, own in made.items()
    }
    return RunRecord(spec, run_row(world_digest="w0"), filled)


def full_specs(count):
    return specs(count, EVALUATIONS, record="full", generations_per_evaluation=BRED)


RUNS = [recorded(spec, np.arange(1, EVALUATIONS + 1)) for spec in full_specs(4)]


def store(results, runs, *, digests=False):
    with Writer(results, "s") as writer:
        for run in runs:
            writer.append(run)
    for path in (path for table in TABLES for path in files(results, table) if not digests):
        with_version(path, SCHEMA_VERSION)
    return {table: load(results, table) for table in TABLES}


def lose(results, table, row):
    [path] = files(results, table)
    rows = pq.read_table(path, partitioning=None)
    run = rows["run_id"][row].as_py()
    pq.write_table(rows.take([number for number in range(len(rows)) if number != row % len(rows)]), path)
    return run


def swept(results, runs):
    """How many runs a sweep does again."""
    with Writer(results, "s") as writer:
        there = finished(results, "s")
        todo = [run for run in runs if run.spec.run_id not in there]
        for run in todo:
            writer.append(run)
    return len(todo)


def alike(results, before):
    return all(
        pd.DataFrame.equals(*(frame.drop(columns="started_at", errors="ignore") for frame in (load(results, table), whole)))
        for table, whole in before.items()
    )


TRIED_ALWAYS = {("evals", (0, False)), ("paths", (-3, True)), ("runs", (0, False))}
"""Of the tables and rows, those that are not left to the slow tests."""


@pytest.mark.filterwarnings("ignore:.*has lost rows")
@pytest.mark.parametrize(
    ("table", "row", "first_compact"),
    [
        pytest.param(table, *case, marks=() if (table, case) in TRIED_ALWAYS else pytest.mark.slow)
        for table in TABLES
        for case in ((0, False), (-3, True))
    ],
)
def test_a_run_that_has_lost_a_row_is_done_again_and_once(tmp_path, table, row, first_compact):
    before = store(tmp_path, RUNS)
    lost = lose(tmp_path, table, row if table != "runs" else row % 4)
    for _ in range(1 + first_compact):
        assert set(finished(tmp_path, "s")) == {run.spec.run_id for run in RUNS} - {lost}
        assert sum(row.done for row in sweep_status(tmp_path)) == 3
        said = load(tmp_path, "runs").set_index("run_id").status.to_dict()
        assert said.pop(lost, "damaged") == "damaged"
        assert set(said.values()) == {"ok"}
        if first_compact:
            remains = compact(tmp_path).set_aside
            assert {path.parts[-4] for path in remains} <= set(TABLES)
    assert swept(tmp_path, RUNS) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # there is nothing more to say
        assert alike(tmp_path, before)
        assert compact(tmp_path).set_aside == ()
        assert alike(tmp_path, before)
        assert swept(tmp_path, RUNS) == 0


@pytest.mark.filterwarnings("ignore:.*has lost rows")
@pytest.mark.parametrize(("table", "row"), [("paths", 1), ("paths", 2), ("evals", -1)])
def test_the_last_step_of_a_drive_a_whole_path_and_the_last_evaluation_are_missed(tmp_path, table, row):
    """Their numbers have no gap."""
    runs = RUNS[:2] if table == "paths" else [record(spec) for spec in specs(2, EVALUATIONS)]
    store(tmp_path, runs)
    lost = lose(tmp_path, table, row)
    assert set(finished(tmp_path, "s")) == {run.spec.run_id for run in runs} - {lost}
    assert load(tmp_path, "runs", where={"status": "damaged"}).run_id.tolist() == [lost]


def test_the_file_is_named_and_what_is_left_of_it_is_kept(tmp_path):
    store(tmp_path, RUNS)
    lose(tmp_path, "paths", 2)
    [path] = files(tmp_path, "paths")
    left = path.read_bytes()
    with pytest.warns(StoreWarning, match=f"{path.name} .* has lost rows .*: 1 of its runs .* sweep s does them again"):
        finished(tmp_path, "s")
    made = compact(tmp_path)
    assert (made.dropped_copies, len(made.set_aside)) == (0, len(TABLES))
    assert left in [kept.read_bytes() for kept in made.set_aside]
    assert "not as it was written, set aside: " in str(made)


@pytest.mark.parametrize("digests", [False, True])
def test_a_run_that_ended_early_or_left_evaluations_out_is_whole(tmp_path, digests):
    """A trial on a robot, whose evaluations the operator may skip and end; its file asks for more."""
    runs = [recorded(spec, np.array(own)) for spec, own in zip(full_specs(3), ([1], [1, 3], [2, 3]), strict=True)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        before = store(tmp_path, runs, digests=digests)
        assert len(finished(tmp_path, "s")) == 3
        assert compact(tmp_path).upgraded_files == (0 if digests else len(TABLES))
        assert alike(tmp_path, before)


def test_rows_are_counted_run_by_run_only_where_something_is_odd(tmp_path, monkeypatch):
    store(tmp_path, [record(spec) for spec in specs(4, EVALUATIONS)])
    monkeypatch.setattr("bns.store.read.counts.placed", lambda *_: pytest.fail("files were read for nothing"))
    assert len(finished(tmp_path, "s")) == 4


@pytest.mark.filterwarnings("ignore:.*has lost rows")
def test_rows_lost_before_a_compaction_by_an_older_version_are_missed_as_well(tmp_path):
    """It gave what was left digests that are right."""
    before = store(tmp_path, RUNS)
    lost = lose(tmp_path, "evals", 0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bns.store.write.merge.suspects", lambda *_: set())
        compact(tmp_path)
    assert lost not in finished(tmp_path, "s")
    assert swept(tmp_path, RUNS) == 1
    assert compact(tmp_path).set_aside == ()
    assert alike(tmp_path, before)


@pytest.mark.slow
@pytest.mark.parametrize("approach", sorted({*APPROACHES.names()} - {"on-robot"}))  # breeds nothing, and came after digests
def test_real_runs_of_every_approach_are_whole_and_every_row_counts(tmp_path, approach):
    from bns.bootstrap.loop import run

    small = {"population_size": 8, "generations_per_evaluation": 3, "training_iterations_per_evaluation": 20}
    spec = RunSpec(approach=approach, world="physics", evaluations=4, record="full", **small)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # those of fits with few drives
        tables = run(spec).tables
    store(tmp_path / "whole", [RunRecord(spec, run_row(world_digest="w0"), tables)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert list(finished(tmp_path / "whole", "s").values()) == ["ok"]
    for table in tables:
        store(tmp_path / table, [RunRecord(spec, run_row(world_digest="w0"), tables)])
        lose(tmp_path / table, table, 0)
        with pytest.warns(StoreWarning, match="has lost rows"):
            assert finished(tmp_path / table, "s") == {}


def test_a_row_too_many_is_no_whole_run_either(tmp_path):
    store(tmp_path, RUNS[:1])
    [path] = files(tmp_path, "evals")
    rows = pq.read_table(path, partitioning=None)
    pq.write_table(rows.take([*range(len(rows)), 0]), path)
    with pytest.warns(StoreWarning, match="has lost rows"):
        assert finished(tmp_path, "s") == {}
