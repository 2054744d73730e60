"""A battery that goes flat during a trial pauses it before the next drive."""

import pytest

from bns.hardware.emulators.devices.khepera import KheperaEmulator
from bns.hardware.link.hardware_log import events
from bns.trial.folder import past_evaluations

from .calls import TRIAL, call, journal_of


@pytest.fixture
def goes_flat(monkeypatch):
    """The robot is asked when its port is opened and before each drive: before the second one it is flat."""
    asked = []

    def volts(_self, _which):
        asked.append(1)
        return "v,7,9000" if len(asked) < 3 else "v,5,2000"

    with monkeypatch.context() as patched:
        patched.setattr(KheperaEmulator, "_battery", volts)
        yield patched


def test_a_battery_that_goes_flat_pauses_the_trial_before_the_next_drive(tmp_path, goes_flat, capsys):
    asked = [*TRIAL, "--evaluations", 2, "--results", tmp_path]
    assert call(*asked) == 3
    assert "the battery is at 5.2 V; charge it to 6 V or more first" in capsys.readouterr().err
    journal = journal_of(tmp_path)
    assert len(past_evaluations(journal)) == len(list(events(journal, "driven"))) == 1
    assert {event["readings"]["battery_v"] for event in events(journal, "driven")} == {7.9}
    assert call(*asked, "--resume") == 2
    assert "the battery is at 5.2 V" in capsys.readouterr().err
    goes_flat.undo()
    assert call(*asked, "--resume") == 0
    assert len(past_evaluations(journal)) == 2
