"""`bns.trial` drives given commands and runs a journal again, as the command does."""

import pandas as pd
import pytest

import bns
from bns.api.common.shown import Shown
from bns.cli.main import main

COMMANDS = "trial,left_m_s,right_m_s,duration_s\n1,0.1,0.08,0.5\n1,0.05,0.1,0.4\n2,0.1,0.1,0.5\n"


@pytest.fixture
def commands(tmp_path):
    (tmp_path / "proposed.csv").write_text(COMMANDS)
    return tmp_path / "proposed.csv"


def test_given_commands_are_driven_as_by_the_command(tmp_path, commands):
    found = bns.trial(commands=commands, emulated=True, results=tmp_path / "a")
    asked = ["trial", "--emulated", "--yes", "--speed", "inf", "--commands", str(commands), "--results", str(tmp_path / "b")]
    assert main(asked) == 0
    folders = [tmp_path / name / "trials" / "experiment-proposed-emulated" for name in "ab"]
    assert found.folder == folders[0]
    tables = [pd.read_csv(folder / "measurements.csv") for folder in folders]
    pd.testing.assert_frame_equal(*tables)
    assert isinstance(found, Shown)
    assert found.summary().startswith("2 trials driven")
    assert repr(found) == f"<ExperimentResult: 2 trials driven, in {found.folder}>"
    assert len(found.measurements.trials) == 2
    with pytest.raises(bns.HardwareError, match=r"there is an experiment in .* already"):
        bns.trial(commands=commands, emulated=True, results=tmp_path / "a")


def test_a_trial_runs_again_from_its_journal(tmp_path):
    small = {"population_size": 20, "training_iterations_per_evaluation": 20, "generations_per_evaluation": 2}
    first = bns.trial(emulated=True, results=tmp_path, evaluations=1, most_rounds=1, max_commands=4, **small)
    again = bns.trial(replay=first.folder / "journal.jsonl", results=tmp_path)
    assert isinstance(again, bns.RunResult)
    same = [name for name in first.run.evals if not name.endswith("_s")]
    pd.testing.assert_frame_equal(again.evals[same], first.run.evals[same])
    stored = bns.load(tmp_path)
    assert set(stored["sweep"]) == {"trials-emulated", "trials-replayed"}


def test_what_does_not_go_together_is_named(tmp_path, commands):
    with pytest.raises(bns.HardwareError, match="replay runs a trial from its journal, without a robot"):
        bns.trial(replay=tmp_path / "journal.jsonl", commands=commands)
    with pytest.raises(bns.HardwareError, match="a real robot needs --rig FILE"):
        bns.trial(commands=commands)
