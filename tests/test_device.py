"""Machines without a GPU: a sentence and exit code 2, and nothing written. In processes of their own: no simulator here."""

import re
import warnings
from types import SimpleNamespace

import pytest

from bns.errors import DeviceError

SWEEP = "name: few\nrobot: khepera\nseeds: 2\nfixed: {evaluations: 1, population_size: 8}\ngrid: {mutation_rate: [0.1]}\n"
NO_GPU = {"NUMBA_CUDA_DRIVER": "/nonexistent/libcuda.so", "CUDA_VISIBLE_DEVICES": ""}


@pytest.mark.parametrize("what", ["run", pytest.param("sweep", marks=pytest.mark.slow)])
def test_without_a_driver(what, tmp_path, bns):
    (tmp_path / "few.yaml").write_text(SWEEP)
    done = bns(what, *(["few.yaml"] if what == "sweep" else []), "--device", "cuda", cwd=tmp_path, **NO_GPU)
    assert done.returncode == 2
    assert re.fullmatch(
        r"bns: --device cuda: no GPU can be used: .*pip install 'bns\[cuda\]', or leave --device out.*\n", done.stderr
    )
    assert [path.name for path in tmp_path.iterdir()] == ["few.yaml"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--jobs", "2"], "--device cuda is the GPU of this machine, and --jobs distributes runs over cores"),
        (["--executor", "dask"], "--device cuda is the GPU of this machine, and --executor dask distributes runs over cores"),
        (["--dry-run"], "--dry-run knows the speed of cores, not of a GPU"),
    ],
)
def test_options_that_do_not_go_together(options, message, tmp_path, capsys):
    from bns.cli.main import main

    (tmp_path / "few.yaml").write_text(SWEEP)
    assert main(["sweep", str(tmp_path / "few.yaml"), "--device", "cuda", *options]) == 2
    assert message in capsys.readouterr().err


def test_the_package_does_not_load_cuda_unless_asked(tmp_path, bns):
    done = bns("run", "--evaluations", "1", "--population-size", "8", "--generations-per-evaluation", "1",
               "--training-iterations-per-evaluation", "1", cwd=tmp_path, PYTHONPROFILEIMPORTTIME="1")  # fmt: skip
    assert done.returncode == 0
    assert "numba.core" in done.stderr
    assert "numba.cuda.cudadrv" not in done.stderr
    assert "bns.cuda" not in done.stderr


LACKING = AttributeError("module 'numpy' has no attribute 'row_stack'")
"""What numba-cuda 0.30.4 raises beside numpy 2.5."""


def test_a_numpy_that_does_not_go_with_numba_cuda(monkeypatch):
    from bns.cuda import device

    def broken(*_):
        raise LACKING

    told = r"does not go with the numpy .*row_stack.*pip install 'bns\[cuda\]', or leave"
    usable = SimpleNamespace(is_available=lambda: True)
    for loads in (False, True):
        device.device_name.cache_clear()
        with monkeypatch.context() as patch:
            if loads:  # and fails with the first kernel
                patch.setattr(device, "_module", lambda: usable)
                patch.setattr(device, "_tried", broken)
            else:
                patch.setattr(device.importlib, "import_module", broken)
            with pytest.raises(DeviceError, match=told):
                device.device_name()


def test_batches_that_leave_most_of_the_gpu_idle_are_not_warned_of(monkeypatch):
    """What numba-cuda 0.30.4 said on an H100, in bold."""
    from bns.cuda import device

    monkeypatch.setattr(device.importlib, "import_module", lambda name: None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        device._module()
        warnings.warn(
            "\x1b[1mGrid size 14 will likely result in GPU under-utilization due to low occupancy.\x1b[0m", stacklevel=1
        )


def test_bench_says_that_there_is_no_gpu(monkeypatch, capsys):
    from tests.bench import gpu

    def none():
        raise DeviceError("no GPU can be used: no driver")

    monkeypatch.setattr(gpu, "device_name", none)
    assert gpu.main([]) == 2
    assert capsys.readouterr().err == "bench-gpu: nothing measured. no GPU can be used: no driver\n"


def slice_of(robot, study_runs, **changes):
    from tests.bench.gpu import Slice

    known = {
        "runs": 2000, "wall_s": 40, "training_s": 30, "evolution_s": 8, "training_ops": 4e14, "evolution_ops": 1e14,
        "moved_bytes": 1e12, "neuron_iterations": 1e13, "cpu_s": 3.0,
    }  # fmt: skip
    return Slice(robot, study_runs, **known | changes)


def test_table_of_the_bench_from_known_figures():
    from tests.bench.gpu import Peak, table_of

    peak = Peak(flops=5e13, bytes_s=5e12)
    lines = table_of([slice_of("khepera", 45_000), slice_of("snake", 30_000, wall_s=200)], peak)
    values = [line.measured for line in lines[:6]]
    assert values == pytest.approx([15, 26.667, 11.25, 22.5, 150, 20666.7], rel=1e-3)
    assert [line.met for line in lines[:2]] == [True, True]
    assert lines[0].floor == pytest.approx(22.5 * 10 / 60)  # 5e14 operations are 10 s at the peak, more than the bytes take
    assert (lines[6].measured, lines[6].met) == (50, None)
    assert (lines[-1].name, lines[-1].measured, lines[-1].met) == ("the whole study with the snake", 65, False)
    assert lines[-1].floor == pytest.approx((22.5 + 15) * 10 / 60)
    assert "together" not in table_of([slice_of("khepera", 45_000)], peak)[-1].name


def test_peak_is_that_of_the_attributes():
    from tests.bench.gpu import peak_of

    class H200:
        compute_capability = (9, 0)
        MULTIPROCESSOR_COUNT, CLOCK_RATE = 132, 1_980_000
        MEMORY_CLOCK_RATE, GLOBAL_MEMORY_BUS_WIDTH = 3_201_000, 6144

    assert peak_of(H200).flops == pytest.approx(66.9e12, rel=1e-3)
    assert peak_of(H200).bytes_s == pytest.approx(4.9e12, rel=1e-2)


@pytest.mark.parametrize(("device", "notes"), [("cpu", 0), ("cuda", 1)])
def test_a_run_on_a_gpu_says_once_that_this_is_experimental(device, notes, monkeypatch, capsys):
    from bns.cli.commands import run
    from bns.cli.main import main

    monkeypatch.setattr(run, "run_by_hand", lambda *_given, **_named: "done")
    assert main(["run", "--device", device]) == 0
    assert capsys.readouterr().err.count("--device cuda is experimental") == notes
