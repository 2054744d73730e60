"""One minute of what ``make soak-dask`` does for twenty, with runs that only wait."""

import pytest
import sweep_jobs
from sweep_jobs import make_sweep

pytest.importorskip("distributed")

from dask_cluster import Cluster
from soak_dask import soak

pytestmark = pytest.mark.slow


def test_workers_that_are_killed_again_and_again_cost_little_and_no_run(tmp_path):
    with Cluster(2) as cluster:
        verdict = soak(cluster, tmp_path, make_sweep(seeds=500), 6.0, 36.0, 12.0, sweep_jobs.half_second)
    assert verdict.kills >= 2
    assert verdict.is_clean, verdict
    assert verdict.repeated >= 1
    assert verdict.kept_time > 0.5  # a worker takes seconds to start: every minute, not every twelve seconds, it is 0.85
