"""The final controller of a trial is driven several times, without becoming further evaluations."""

import numpy as np
import pandas as pd
import pytest

import bns
from bns.cli.main import main
from bns.errors import TrialPausedError
from bns.hardware.link.hardware_log import events
from bns.robots import load_robot
from bns.trial.again.repeats import drive_repeats, final_evaluation
from bns.trial.folder import past_evaluations, past_repeats

from .. import soak

TRIAL = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", *soak.QUICK, "--evaluations", 2]


def call(*arguments):
    return main([str(a) for a in arguments])


def journal_of(results):
    [journal] = (results / "trials").glob("*/journal.jsonl")
    return journal


@pytest.fixture(scope="module")
def repeated(tmp_path_factory):
    """A trial of two evaluations whose final controller was driven three times."""
    results = tmp_path_factory.mktemp("repeated")
    assert call(*TRIAL, "--repeats", 3, "--results", results) == 0
    return results


def test_all_drives_of_the_final_controller_are_kept_in_the_trial_s_folder(repeated):
    table = pd.read_csv(journal_of(repeated).parent / "repeats.csv")
    last = past_evaluations(journal_of(repeated))[-1]
    assert table["evaluation"].unique().tolist() == [2]
    assert table["repeat"].unique().tolist() == [1, 2, 3]
    for _, drive in table.groupby("repeat"):
        commands = drive[list(load_robot("khepera").command_columns)].to_numpy()[1:]
        np.testing.assert_allclose(commands[:, :2], last.picked[: len(commands), :2], atol=1.0)
    ends = table[table["step"] == 1][["x_m", "y_m"]].to_numpy()
    assert 0 < np.abs(ends - ends[0]).max() < 0.1  # alike, and each measured anew


def test_repeats_are_no_evaluations_and_no_measurements_of_them(repeated):
    journal = journal_of(repeated)
    assert len(past_evaluations(journal)) == 2
    assert len(past_repeats(journal, 2)) == 2
    assert past_repeats(journal, 1) == []
    assert pd.read_csv(journal.parent / "measurements.csv")["trial"].unique().tolist() == [1, 2]
    assert call("trial", "--replay", journal, "--results", repeated) == 0
    rows = bns.load(repeated)
    first, again = (rows[rows["sweep"] == s].reset_index(drop=True) for s in ("trials-emulated", "trials-replayed"))
    np.testing.assert_array_equal(first["best_fitness"], again["best_fitness"])


def test_what_was_repeated_is_not_driven_again(tmp_path):
    assert call(*TRIAL, "--results", tmp_path) == 0
    journal = journal_of(tmp_path)
    assert not list(events(journal, "repeat-driven"))  # a Khepera's final controller is driven once
    assert not (journal.parent / "repeats.csv").exists()
    for count in (2, 3, 3):
        assert call(*TRIAL, "--resume", "--repeats", count, "--results", tmp_path) == 0
    assert [event["repeat"] for event in events(journal, "repeat-driven")] == [2, 3]
    assert len(list(events(journal, "driven"))) == 2


def test_a_pause_between_repeats_loses_none(repeated):
    class Paused:
        def repeat(self, number, again, controller):
            raise TrialPausedError(f"before drive {again} of evaluation {number}")

    with pytest.raises(TrialPausedError, match="before drive 4 of evaluation 2"):
        drive_repeats(Paused(), journal_of(repeated), 2, 5)
    for count in (1, 2, 3):
        assert len(drive_repeats(Paused(), journal_of(repeated), 2, count)) == count


def test_the_final_controller_is_the_last_that_succeeded_or_the_last():
    numbers = np.arange(1, 5)
    assert final_evaluation({"evaluation": numbers, "evaluated_success": np.array([False, True, True, False])}) == 3
    assert final_evaluation({"evaluation": numbers, "evaluated_success": np.zeros(4, bool)}) == 4
