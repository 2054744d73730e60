"""The guide for Python, typed from top to bottom in an empty folder."""

import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

GUIDE = (Path(__file__).resolve().parents[2] / "docs" / "python.md").read_text()
BLOCKS = re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL)


@pytest.fixture(scope="module")
def typed(tmp_path_factory):
    """The names that all blocks leave behind."""
    folder, names = tmp_path_factory.mktemp("guide"), {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for block in BLOCKS:
            exec(block, names)
    return names | {"folder": folder}


def test_the_guide_finds_what_it_hid(typed):
    assert typed["found"].verdict in {"effects", "tie"}
    assert "turn-slip" in typed["found"].ranking.index[:2]
    assert typed["better"].effects
    assert len(typed["log"]) == 16
    values = typed["added"].model.effects[0]
    low, high = values.intervals["slip_s"]
    assert low < 0.12 < high
    assert typed["added"].errors.loc["turn-slip", "command"] < typed["added"].errors.loc["as given", "command"]


def test_the_guide_leaves_the_files_that_it_names(typed):
    for name in ("world.yaml", "log.csv", "extended.yaml", "report.html"):
        assert (typed["folder"] / name).stat().st_size > 100, name
    assert (typed["folder"] / typed["trial"].folder / "journal.jsonl").is_file()
    assert typed["evals"]["run_id"].nunique() == 4


def test_results_look_as_the_guide_shows_them(typed):
    shown = re.search(r"<RunResult: (.*) in ", GUIDE)[1]
    assert repr(typed["run"]).startswith(f"<RunResult: {shown} in ")
