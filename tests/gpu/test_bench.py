"""The benches that wait for a GPU, end to end on tiny runs: nothing in them must fail on the first contact with one."""

import json

import numpy as np
import pytest

from bns.cuda.device import OutOfDeviceMemoryError
from bns.spec import RunSpec
from tests.bench import devices, gpu

TASKS = {"khepera": "circle", "snake": "two-regions"}
TINY = {
    "population_size": 3, "evaluations": 1, "generations_per_evaluation": 1, "training_iterations_per_evaluation": 1,
    "min_commands": 1, "max_commands": 1,
}  # fmt: skip


def tiny(robot, runs, **given):
    return [RunSpec(robot=robot, task=TASKS[robot], seed=seed, **TINY | given) for seed in range(runs)]


@pytest.fixture(autouse=True)
def _few_threads(monkeypatch):
    monkeypatch.setattr("bns.cuda.batch.THREADS", 2)


class Simulated:
    """Attributes of a device, which the simulator's has not."""

    compute_capability = (9, 0)
    MULTIPROCESSOR_COUNT, CLOCK_RATE = 132, 1_980_000
    MEMORY_CLOCK_RATE, GLOBAL_MEMORY_BUS_WIDTH = 3_201_000, 6144


@pytest.mark.slow
def test_slices_of_both_studies_are_measured_and_the_table_is_printed(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(gpu, "current_device", Simulated)
    monkeypatch.setattr(gpu, "ordered_specs", lambda sweep: tiny(sweep.robot, 3))
    monkeypatch.setattr(gpu, "BATCH", {"khepera": 1, "snake": 1})
    assert gpu.main(["--runs", "2", "--seconds", "1e9", "--cpu-runs", "1", "--json", str(tmp_path / "b.json")]) == 0
    told = capsys.readouterr().out
    assert "khepera: the study of 3 runs, from 2 of them" in told
    assert "snake: the study of 3 runs, from 2 of them" in told
    assert "the whole study with the snake" in told
    assert "nan" not in (tmp_path / "b.json").read_text().lower()


def test_memory_that_is_full_is_said(monkeypatch, capsys):
    def full(specs):
        raise OutOfDeviceMemoryError("CUDA_ERROR_OUT_OF_MEMORY")

    monkeypatch.setattr(gpu, "current_device", Simulated)
    monkeypatch.setattr(gpu, "ordered_specs", lambda sweep: tiny(sweep.robot, 3))
    monkeypatch.setattr(gpu, "warm", id)
    monkeypatch.setattr(gpu, "Batch", full)
    assert gpu.main([]) == 2
    assert "bench-gpu: nothing measured. CUDA_ERROR_OUT_OF_MEMORY" in capsys.readouterr().err


@pytest.mark.slow
def test_devices_are_compared_by_runs_of_both_robots(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(devices, "specs_of", tiny)
    path = tmp_path / "new" / "d.json"
    assert devices.main(["--runs", "2", "--evaluations", "1", "--jobs", "1", "--json", str(path)]) == 0
    rows = json.loads(path.read_text())
    assert [(row["robot"], row["column"]) for row in rows] == [
        (robot, column) for robot in ("khepera", "snake") for column in ("success", "diversity", "fitness_error")
    ]
    for row in rows:
        assert row["gpu"] == pytest.approx(row["cpu"], rel=1e-4)
    assert capsys.readouterr().out.count("the same") == 6


def side(seed, shift=0.0, rate=0.5):
    draws = np.random.default_rng(seed)
    columns = (draws.random((3, 8)) for _ in range(200))
    return [{"success": a < rate, "diversity": b + shift, "fitness_error": c} for a, b, c in columns]


@pytest.mark.parametrize(("changes", "differing"), [({}, set()), ({"shift": 0.2}, {"diversity"}), ({"rate": 0.8}, {"success"})])
def test_a_difference_is_found_and_none_is_not(changes, differing, capsys):
    specs = [RunSpec(seed=seed, evaluations=8) for seed in range(200)]
    code = devices.report(devices.compared(specs, side(1), side(2, **changes)), None)
    told = capsys.readouterr().out.splitlines()
    assert code == bool(differing)
    assert {line.split()[1] for line in told if "DIFFERS" in line} == differing


def test_runs_at_the_sources_settings_take_the_tasks_by_turns():
    specs = devices.specs_of("snake", 4, evaluations=5)
    assert [(spec.task, spec.seed) for spec in specs] == [
        ("three-regions", 0), ("two-regions", 1), ("three-regions", 2), ("two-regions", 3),
    ]  # fmt: skip
