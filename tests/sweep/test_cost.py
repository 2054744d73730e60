"""What sweeps would cost. How near that comes on a machine is a line of ``make bench``."""

import math
from pathlib import Path

import pytest
from sweep_jobs import make_sweep

from bns.cli.main import main
from bns.store import load
from bns.sweep.executors import load_executor
from bns.sweep.expand.grid import parse_sweep
from bns.sweep.expand.shard import Shard
from bns.sweep.forecast.cost import MACHINES, Cost, Machine, cost_table, total
from bns.sweep.forecast.plan import START_UP_S, plan, wall_s
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.request import Request
from bns.sweep.runner import run_sweep

TEXT = """
name: mixed
robot: khepera
seeds: 2
fixed: {evaluations: 40}
grid: {population_size: [20, 100, 400]}
"""


def test_workers_start_and_work_in_rounds_and_one_worker_does_neither(tmp_path):
    assert wall_s(60.0, 6, 2) == START_UP_S + 30
    assert wall_s(60.0, 6, 4) == START_UP_S + 20  # four runs at once, then two
    assert wall_s(0.0, 0, 4) == 0
    sweep = parse_sweep(TEXT, Path("mixed.yaml"))
    run_sweep(sweep, tmp_path, executor=SerialExecutor(), limit=3)
    one, four = plan(sweep, tmp_path, 1), plan(sweep, tmp_path, 4)
    assert four.seconds_estimate == pytest.approx(START_UP_S + one.seconds_estimate / one.remaining)


def test_time_on_a_machine():
    cost = Cost("demo", 1280, 3.2, 1e6, 9.0)
    one, many = Machine("one", 1, 1), Machine("many", 20, 64)
    assert cost.seconds_on(one) == START_UP_S + 3.2 * 3600
    assert cost.seconds_on(many) == START_UP_S + 9.0
    assert cost.seconds_on(Machine("more", 200, 64)) == cost.seconds_on(many)  # a run cannot be divided
    assert Cost("done", 0, 0.0, 0.0, 0.0).seconds_on(one) == 0


def test_table_adds_up_and_says_what_is_unknown():
    costs = [Cost("a", 10, 0.5, 2**21, 180.0), Cost("b", 30, math.nan, 2**20, math.nan)]
    assert total(costs[:1] * 2).core_hours == 1.0
    lines = cost_table(costs).splitlines()
    assert [line.split()[0] for line in lines] == ["sweep", "a", "b", "all"]
    assert lines[1].split()[1:5] == ["10", "0.50", "2", "0:07"]
    assert lines[2].count("unknown") == 1 + len(MACHINES)
    assert "cluster (20 × 64 cores)" in lines[0]


def test_plan_of_a_shard_is_of_its_share(tmp_path):
    sweep = make_sweep(combos=2, seeds=4)
    assert plan(sweep, tmp_path, 1, Shard(1, 4), warm_up=lambda: None).remaining == 2


@pytest.fixture
def sweep_file(tmp_path):
    path = tmp_path / "mixed.yaml"
    path.write_text(TEXT.replace("evaluations: 40", "evaluations: 2").replace(", 100, 400", ", 30"))
    return path


def test_command_prints_the_table_and_where_it_comes_from(sweep_file, tmp_path, capsys):
    assert main(["plan", str(sweep_file), "--results", str(tmp_path / "none")]) == 0
    out = capsys.readouterr().out
    assert "here (" in out.splitlines()[0]
    assert out.splitlines()[1].split()[:2] == ["mixed", "4"]
    assert "mixed: the parts of one trial run" in out
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("options", "where"),
    [
        (["--jobs", "3"], "3 worker processes on"),
        (["--executor", "dask", "--jobs", "2"], "a Dask scheduler of its own with 2 worker processes"),
        (["--executor", "slurm", "--shards", "4", "--jobs", "8", "--try-locally"], "4 jobs of 8 worker processes, 1 array"),
        (["--shard", "2/4"], "mixed: 1 run, 0 done"),
    ],
)
def test_dry_run_says_what_would_run_where(sweep_file, tmp_path, capsys, options, where):
    assert main(["sweep", str(sweep_file), "--dry-run", "--results", str(tmp_path / "none"), *options]) == 0
    assert where in capsys.readouterr().out
    assert not (tmp_path / "none").exists()


def test_a_shard_by_hand(sweep_file, tmp_path):
    results = ["--results", str(tmp_path / "a"), "--jobs", "1"]
    assert main(["sweep", str(sweep_file), "--shard", "1/2", *results]) == 0
    assert len(load(tmp_path / "a", "runs")) == 2


def test_a_machine_is_used_whole(monkeypatch, tmp_path):
    monkeypatch.setattr("bns.sweep.jobs.cores.cpu_count", lambda: 64)
    place = load_executor("joblib").placement(Request(tmp_path))
    assert (place.workers, place.where.split()[0]) == (64, "64")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--shard", "4"], "a shard is written K/N"),
        (["--slurm", "long"], "'long' is not NAME=VALUE"),
        (["--executor", "ray"], "unknown executor 'ray'"),
    ],
)
def test_odd_options_are_explained(sweep_file, capsys, options, message):
    with pytest.raises(SystemExit) if options[0] != "--executor" else _nothing():
        assert main(["sweep", str(sweep_file), *options]) == 2
    assert message in capsys.readouterr().err


def _nothing():
    from contextlib import nullcontext

    return nullcontext()
