"""Machines without a GPU: a sentence and exit code 2, and nothing written. In processes of their own: no simulator here."""

import re

import pytest

SWEEP = "name: few\nrobot: khepera\nseeds: 2\nfixed: {evaluations: 1, population_size: 8}\ngrid: {mutation_rate: [0.1]}\n"
NO_GPU = {"NUMBA_CUDA_DRIVER": "/nonexistent/libcuda.so", "CUDA_VISIBLE_DEVICES": ""}


@pytest.mark.parametrize("what", ["run", "sweep"])
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
        (["--jobs", "2"], "--device cuda is the GPU of this machine, and --jobs shares runs out"),
        (["--executor", "dask"], "--device cuda is the GPU of this machine, and --executor dask shares runs out"),
        (["--dry-run"], "--dry-run knows the pace of cores, not of a GPU"),
    ],
)
def test_options_that_do_not_go_together(options, message, tmp_path, capsys):
    from bns.cli import main

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
