"""The notebooks that `bns example` copies: they hold no outputs, and their cells run from top to bottom."""

import json

import pytest

from bns.examples import FILES, FOLDER, copy_example

pytestmark = pytest.mark.slow

NOTEBOOKS = [name for name in FILES if name.endswith(".ipynb")]


def code_cells(name):
    return [cell for cell in json.loads((FOLDER / name).read_text())["cells"] if cell["cell_type"] == "code"]


def executed(name, folder):
    """The names that all code cells leave behind."""
    copy_example(folder)
    names: dict = {}
    with pytest.MonkeyPatch.context() as here:
        here.chdir(folder)
        for cell in code_cells(name):
            exec("".join(cell["source"]), names)
    return names


def test_there_are_notebooks_without_outputs():
    assert len(NOTEBOOKS) == 2
    for name in NOTEBOOKS:
        book = json.loads((FOLDER / name).read_text())
        assert book["nbformat"] == 4
        assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code_cells(name))
        assert len({cell["id"] for cell in book["cells"]}) == len(book["cells"])


def test_the_diagnosis_names_the_lag_and_then_nothing(tmp_path):
    names = executed("diagnosis.ipynb", tmp_path / "new")
    assert names["found"].verdict == "effects"
    assert list(names["found"].effects) == ["motor-lag"]
    assert names["again"].verdict == "none"
    assert (tmp_path / "new" / "extended.yaml").is_file()


def test_the_sweep_draws_its_figure(tmp_path):
    names = executed("sweep.ipynb", tmp_path / "new")
    assert names["success"].shape == (15, 2)
    assert len(names["evals"]) == 8 * 15
    assert (tmp_path / "new" / "success.png").stat().st_size > 5000
