"""A sweep of the snake: killed, resumed, and beside the Khepera's in one store."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import numpy as np
import pandas as pd
import pytest

from bns.errors import StoreError
from bns.store import query
from bns.store.read.reader import load
from bns.sweep.expand.grid import load_sweep
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.jobs.job import run_job
from bns.sweep.runner import run_sweep

pytestmark = pytest.mark.slow

TEXT = """
name: {robot}-tiny
robot: {robot}
seeds: 3
fixed: {{evaluations: 3, generations_per_evaluation: 2, training_iterations_per_evaluation: 50, record: {record}}}
grid:
  task: [{tasks}]
  population_size: [12, 40]
"""


@pytest.fixture
def snakes(tmp_path):
    (tmp_path / "snake-tiny.yaml").write_text(TEXT.format(robot="snake", tasks="two-regions, three-regions", record="full"))
    return tmp_path / "snake-tiny.yaml"


def started(file, results):
    command = [sys.executable, "-m", "bns", "sweep", str(file), "--jobs", "2", "--results", str(results)]
    return subprocess.Popen(command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def deterministic(frame: pd.DataFrame) -> pd.DataFrame:
    return frame[[name for name in frame if not name.endswith("_s")]]


def kill_when_under_way(file, results):
    process, end = started(file, results), time.monotonic() + 120
    while process.poll() is None and time.monotonic() < end:
        with suppress(StoreError):  # there is nothing to read yet
            if len(load(results, "runs")) >= 1:
                break
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def test_a_killed_sweep_goes_on_to_the_same_numbers_and_both_robots_share_a_store(snakes, tmp_path):
    kill_when_under_way(snakes, tmp_path / "a")
    assert len(load(tmp_path / "a", "runs")) >= 1
    assert started(snakes, tmp_path / "a").wait(timeout=600) == 0
    run_sweep(load_sweep(snakes), tmp_path / "b", job=run_job, executor=SerialExecutor(run_job))
    for table in ("evals", "paths", "generations", "probes"):
        resumed, whole = (deterministic(load(tmp_path / place, table)) for place in "ab")
        pd.testing.assert_frame_equal(resumed, whole)
    evals = load(tmp_path / "a")
    assert len(evals) == 2 * 2 * 3 * 3
    assert evals.success.notna().all()
    assert evals.success_7cm.isna().all()
    assert np.isfinite(evals.fitness_world).all()
    with_wheels_beside(tmp_path)


def with_wheels_beside(tmp_path):
    file = tmp_path / "khepera-tiny.yaml"
    file.write_text(TEXT.format(robot="khepera", tasks="circle", record="full"))
    run_sweep(load_sweep(file), tmp_path / "b", job=run_job, executor=SerialExecutor(run_job))
    rows = query(
        tmp_path / "b",
        "SELECT robot, count(*) AS n, count(left_units) AS wheels, count(yellow_x_m) AS markers FROM paths "
        "WHERE step > 0 GROUP BY robot ORDER BY robot",
    )
    assert rows.robot.tolist() == ["khepera", "snake"]
    assert (rows.wheels.tolist()[0], rows.markers.tolist()[0]) == (rows.n[0], 0)
    assert (rows.wheels.tolist()[1], rows.markers.tolist()[1]) == (0, rows.n[1])
