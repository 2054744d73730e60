"""What is given in Python as no command line could: models, arrays, numbers of another kind; and how results tell numbers."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import bns
from bns.api.run import _named
from bns.api.sweep import _checked_jobs
from tests.diagnose.worlds import NOMINAL, measured


@pytest.mark.parametrize(
    ("world", "said"),
    [
        (bns.Model("khepera").with_effect("motor-lag", tau_s=0.2), r"^world is the model khepera in memory.*model\.save\('mine"),
        (3, "^world is given as int; give a name"),
    ],
)
def test_a_world_that_is_no_name_is_told_how_to_be_given(world, said):
    with pytest.raises(bns.SpecError, match=said) as refused:
        bns.run(world=world)
    assert "a world that changes is written" not in str(refused.value)
    assert "world='physics>mine.yaml@50'" in str(refused.value)


def test_a_path_is_the_text_of_it():
    assert _named(Path("mine.yaml")) == "mine.yaml"


@pytest.mark.parametrize("jobs", [0, -1, "2", 1.5, True])
def test_processes_are_counted_as_the_command_line_counts_them(tmp_path, jobs):
    sweep = bns.Sweep("small", "khepera", fixed={"evaluations": 1})
    for ask in (sweep.run, sweep.plan):
        with pytest.raises(bns.SpecError, match=f"^jobs is {jobs!r}; it must be a whole number of 1 or more"):
            ask(tmp_path / "results", jobs=jobs)
    assert not (tmp_path / "results").exists()
    assert _checked_jobs(np.int64(2)) == 2


def test_one_of_a_thing_is_not_told_as_several(tmp_path):
    assert "1 combination on 1 seed, 1 run>" in repr(bns.Sweep("small", "khepera", fixed={"evaluations": 1}))
    table = measured(NOMINAL, trials=2, commands=2)
    log = bns.Measurements(table).without(str(table["trial"].iloc[0]))
    assert "table, 1 trial, " in repr(log)
    assert repr(bns.compare(log, NOMINAL)).endswith("ahead, 1 trial>")


def test_axes_that_are_several_are_told_so():
    log = bns.Measurements(measured(NOMINAL, trials=2, commands=2))
    axes = np.array([Figure().add_subplot(), Figure().add_subplot()])
    with pytest.raises(bns.BnsError, match=r"ax is given as ndarray; give one matplotlib Axes \(of several, such as axes\[0\]\)"):
        log.plot_paths(ax=axes)
    assert log.plot_paths(ax=axes[0]) is axes[0]
