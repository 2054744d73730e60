"""Batches behind a sweep: order, size, resume, memory that is full, runs that fail, a GPU that fails."""

import itertools
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

from bns.cli.main import main
from bns.cuda import batch, device
from bns.cuda.device import OutOfDeviceMemoryError, faults
from bns.errors import DeviceError
from bns.spec import RunSpec
from bns.store.read.reader import load
from bns.store.schema import PARAMETERS, SCHEMAS
from bns.sweep.budget import Budget
from bns.sweep.expand.grid import Sweep
from bns.sweep.expand.order import ordered_specs
from bns.sweep.jobs import batches
from bns.sweep.jobs.batches import BatchExecutor, DeviceWarning
from bns.sweep.runner import run_sweep

SWEEP = Sweep("demo", "khepera", 3, tuple({"population_size": 10 + n, "evaluations": 2} for n in range(4)), "", Path("x.yaml"))


class Steps:
    """A batch that computes nothing; `room` runs fit into memory; runs in `lost` come back without their numbers."""

    begun: ClassVar[list] = []
    room, fault, lost = 100, None, ()

    def __init__(self, specs):
        Steps.begun.append(list(specs))
        if len(specs) > Steps.room:
            raise OutOfDeviceMemoryError("CUDA_ERROR_OUT_OF_MEMORY")
        self.specs, self.left = specs, 2

    @property
    def done(self):
        return self.left == 0

    def step(self):
        if Steps.fault is not None:
            with faults():
                raise Steps.fault
        self.left -= 1

    def evals(self):
        return [ArithmeticError("diversity is nan") if spec.run_id in Steps.lost else columns(spec) for spec in self.specs]


def columns(spec):
    own = [f for f in SCHEMAS["evals"] if f.name not in {"run_id", "robot", *PARAMETERS}]
    values = {f.name: np.zeros(spec.evaluations, f.type.to_pandas_dtype()) for f in own}
    return values | {"evaluation": np.arange(1, spec.evaluations + 1)}


@pytest.fixture(autouse=True)
def _fresh(monkeypatch):
    for name, value in {"begun": [], "room": 100, "fault": None, "lost": ()}.items():
        monkeypatch.setattr(Steps, name, value)


def swept(results, executor=None, **options):
    return run_sweep(SWEEP, results, executor=executor or BatchExecutor(make=Steps, first=5), warm_up=int, **options)


def test_runs_are_taken_in_the_sweeps_order_and_stored_once(tmp_path):
    assert swept(tmp_path).done == 12
    assert list(itertools.chain(*Steps.begun)) == ordered_specs(SWEEP)
    assert [len(batch) for batch in Steps.begun] == [5, 7]  # the second is larger, and takes what there is
    runs = load(tmp_path, "runs")
    assert set(runs["run_id"]) == {spec.run_id for spec in ordered_specs(SWEEP)}
    assert runs["versions"].str.contains(f'"device": "{device.device_name()}"', regex=False).all()
    assert runs["world_digest"].nunique() == 1


def test_what_is_done_is_skipped(tmp_path):
    swept(tmp_path, limit=4)
    Steps.begun.clear()
    assert swept(tmp_path).new == 8
    assert list(itertools.chain(*Steps.begun)) == ordered_specs(SWEEP)[4:]


@pytest.mark.parametrize("wall_s", [0.5, 10.0, 600.0])
def test_batches_grow_and_shrink_towards_a_minute(monkeypatch, wall_s):
    clock = itertools.count()
    monkeypatch.setattr(batches.time, "perf_counter", lambda: wall_s * next(clock))
    executor = BatchExecutor(make=Steps, first=4, largest=40)
    for spec in ordered_specs(SWEEP)[: executor.free]:
        executor.submit(spec)
    while executor.in_flight:
        executor.next(0.0)
    assert executor.free == {0.5: 16, 10.0: 16, 600.0: 1}[wall_s]


def test_a_batch_is_no_larger_than_the_time_that_is_left_allows(monkeypatch):
    clock = itertools.count()
    monkeypatch.setattr(batches.time, "perf_counter", lambda: 10.0 * next(clock))
    executor = BatchExecutor(lambda: 25.0, make=Steps, first=4)
    for spec in ordered_specs(SWEEP)[:4]:
        executor.submit(spec)
    while executor.in_flight:
        executor.next(0.0)
    assert executor.free == 10


@pytest.mark.parametrize(("wall_s", "room"), [(0.5, 4), (600.0, 1)])
def test_a_batch_that_was_not_full_makes_the_next_one_smaller_but_not_larger(monkeypatch, wall_s, room):
    clock = itertools.count()
    monkeypatch.setattr(batches.time, "perf_counter", lambda: wall_s * next(clock))
    executor = BatchExecutor(make=Steps, first=4)
    for spec in ordered_specs(SWEEP)[:2]:
        executor.submit(spec)
    while executor.in_flight:
        executor.next(0.0)
    assert executor.free == room


def test_no_run_is_taken_while_a_batch_is_under_way():
    executor = BatchExecutor(make=Steps, first=4)
    for spec in ordered_specs(SWEEP)[:2]:
        executor.submit(spec)
    assert executor.free == 2
    assert executor.next(-1.0) is None  # one evaluation
    assert (executor.free, executor.in_flight) == (0, 2)


def test_runs_of_a_batch_share_its_processor_time_and_all_took_as_long_as_it_did(monkeypatch):
    for name, step_s in (("perf_counter", 5.0), ("process_time", 8.0)):
        clock = itertools.count()
        monkeypatch.setattr(batches.time, name, lambda clock=clock, step_s=step_s: step_s * next(clock))
    executor = BatchExecutor(make=Steps, first=4)
    for spec in ordered_specs(SWEEP)[:4]:
        executor.submit(spec)
    records = [record for record in (executor.next(0.0) for _ in range(9)) if record is not None]
    assert [(record.run["wall_s"], record.run["cpu_s"]) for record in records] == [(5.0, 2.0)] * 4


def test_no_batch_is_begun_when_the_time_is_up(tmp_path):
    assert swept(tmp_path, budget=Budget(0.0)).stopped_by == "budget"
    assert Steps.begun == []


def test_memory_that_is_full_halves_the_batch_and_loses_nothing(tmp_path):
    Steps.room = 2
    with pytest.warns(DeviceWarning, match=r"5 runs side by side do not fit .*OUT_OF_MEMORY.*; going on with 2"):
        assert swept(tmp_path).done == 12
    assert [len(batch) for batch in Steps.begun] == [5, 2, 2, 2, 2, 2, 2]
    assert list(itertools.chain(*Steps.begun[1:])) == ordered_specs(SWEEP)


def test_a_run_that_does_not_fit_alone_fails_alone(tmp_path):
    Steps.room = 0
    assert swept(tmp_path, BatchExecutor(make=Steps, first=1), limit=2).failed == 2
    assert load(tmp_path, "runs")["error"].str.contains("not even this run alone fits").all()


def test_a_run_without_its_numbers_fails_alone(tmp_path):
    Steps.lost = (ordered_specs(SWEEP)[1].run_id,)
    summary = swept(tmp_path)
    assert (summary.done, summary.failed) == (11, 1)
    runs = load(tmp_path, "runs").set_index("run_id")
    assert runs.loc[Steps.lost[0], "error"].startswith("ArithmeticError: diversity is nan")


class _DriverError(Exception):
    pass


_DriverError.__module__ = "numba.cuda.cudadrv.driver"


def test_a_gpu_that_fails_ends_the_sweep_and_what_was_stored_stays(tmp_path):
    swept(tmp_path, limit=3)
    Steps.fault = _DriverError("[700] Call to cuMemcpyDtoH results in CUDA_ERROR_ILLEGAL_ADDRESS")
    with pytest.raises(DeviceError, match=r"the GPU failed: .*ILLEGAL_ADDRESS.*What was finished is stored"):
        swept(tmp_path)
    Steps.fault = None
    assert swept(tmp_path).new == 9


def test_memory_that_fills_up_later_halves_the_batch_too():
    Steps.fault = _DriverError("[2] Call to cuMemAlloc results in CUDA_ERROR_OUT_OF_MEMORY")
    executor = BatchExecutor(make=Steps, first=4)
    for spec in ordered_specs(SWEEP)[:4]:
        executor.submit(spec)
    with pytest.warns(DeviceWarning, match="going on with 2"):
        assert executor.next(0.0) is None
    assert (executor.in_flight, executor.free) == (4, 0)


def test_what_is_cancelled_is_not_in_flight():
    executor = BatchExecutor(make=Steps, first=4)
    executor.submit(ordered_specs(SWEEP)[0])
    executor.cancel()
    assert (executor.in_flight, executor.free, executor.next(0.0)) == (0, 0, None)


def test_faults_of_our_own_are_left_as_they_are():
    with pytest.raises(KeyError), faults():
        raise KeyError("x")


def test_sweeps_of_both_robots_from_the_command_line_on_the_simulated_gpu(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("bns.cuda.batch.THREADS", 2)
    for robot, task in (("khepera", "circle"), ("snake", "two-regions")):
        Path(f"{robot}.yaml").write_text(
            f"name: few-{robot}\nrobot: {robot}\nseeds: 2\nfixed: {{task: {task}, evaluations: 1, population_size: 3, "
            "generations_per_evaluation: 0, training_iterations_per_evaluation: 0, min_commands: 1, max_commands: 4}\n"
            "grid: {mutation_rate: [0.1]}\n"
        )
        assert main(["sweep", f"{robot}.yaml", "--device", "cuda"]) == 0
    assert load(Path("results"), "runs")["status"].tolist() == ["ok"] * 4
    assert load(Path("results"))["robot"].value_counts().to_dict() == {"khepera": 2, "snake": 2}
    spec = RunSpec(seed=1, evaluations=1, population_size=3, generations_per_evaluation=0, min_commands=1, max_commands=4)
    spec = replace(spec, training_iterations_per_evaluation=0)
    evals = load(Path("results"))
    assert spec.run_id in set(evals["run_id"])  # by the same name as on the CPU


def test_a_gpu_whose_memory_is_full_before_anything_begins(monkeypatch, tmp_path, capsys):
    def none(specs):
        raise OutOfDeviceMemoryError("[2] Call to cuMemAlloc results in CUDA_ERROR_OUT_OF_MEMORY")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(batch, "Batch", none)
    batch.warm.cache_clear()
    Path("few.yaml").write_text("name: few\nrobot: khepera\nseeds: 1\nfixed: {evaluations: 1}\ngrid: {mutation_rate: [0.1]}\n")
    assert main(["sweep", "few.yaml", "--device", "cuda"]) == 2
    assert "the GPU's memory is full ([2] Call to cuMemAlloc" in capsys.readouterr().err


def test_a_gpu_without_room_for_the_trial_kernel_is_not_called_old(monkeypatch):
    def none(module):
        raise _DriverError("[2] Call to cuDevicePrimaryCtxRetain results in CUDA_ERROR_OUT_OF_MEMORY")

    monkeypatch.setattr(device, "_tried", none)
    device.device_name.cache_clear()
    with pytest.raises(DeviceError, match=r"memory is full .*CtxRetain.*CUDA_VISIBLE_DEVICES"):
        device.device_name()


def test_a_driver_without_a_compiler_is_not_called_missing(monkeypatch):
    cuda = SimpleNamespace(is_available=lambda: False, cuda_error=lambda: None)
    monkeypatch.setattr(device, "_module", lambda: cuda)
    device.device_name.cache_clear()
    with pytest.raises(DeviceError, match=r"compiler \(NVVM\) is not there\. .*pip install 'bns\[cuda\]'"):
        device.device_name()
