"""Fault plans: read from YAML, reproducible by seed."""

import numpy as np
import pytest

from bns.errors import HardwareError
from bns.hardware.emulators.faults import Fault, Faults, load_plan


def plan(tmp_path, text):
    file = tmp_path / "plan.yaml"
    file.write_text(text)
    return load_plan(file)


def pattern(faults, kind="lost-reply"):
    return [faults.strikes(kind, 0.1 * i) for i in range(300)]


def test_a_plan_strikes_at_its_rate_and_the_same_way_for_a_seed(tmp_path):
    text = "seed: {}\nfaults:\n  - {{kind: lost-reply, rate: 0.2}}"
    first = pattern(plan(tmp_path, text.format(3)).of("khepera"))
    assert 30 < sum(first) < 90
    assert first == pattern(plan(tmp_path, text.format(3)).of("khepera"))
    assert first != pattern(plan(tmp_path, text.format(4)).of("khepera"))
    assert first != pattern(plan(tmp_path, text.format(3)).of("wii"))


def test_a_timed_fault_strikes_once_and_lasts():
    faults = Faults((Fault("lost-reply", at_s=1.0, for_s=0.5),))
    np.testing.assert_array_equal(np.flatnonzero(pattern(faults)), [10, 11, 12, 13, 14])
    once = Faults((Fault("lost-reply", at_s=1.0),))
    assert np.flatnonzero(pattern(once)).tolist() == [10]


def test_nothing_planned_nothing_strikes():
    assert not any(pattern(Faults()))
    assert not any(pattern(Faults((Fault("lost-reply", rate=0.0),))))
    assert all(pattern(Faults((Fault("lost-reply", rate=1.0),))))
    assert not any(pattern(Faults((Fault("lost-reply", rate=1.0),)), kind="hang-up"))


def test_a_changed_byte_is_always_another_one():
    faults = Faults((), 1)
    for _ in range(50):
        changed = faults.byte(b"e,100,100\r\n")
        assert sum(a != b for a, b in zip(changed, b"e,100,100\r\n", strict=True)) == 1
    assert faults.byte(b"") == b""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("faults: [{kind: lost-replies, rate: 0.1}]", "unknown fault 'lost-replies'. Did you mean 'lost-reply'"),
        ("faults: [{kind: hang-up}]", "hang-up needs either rate"),
        ("faults: [{kind: hang-up, rate: 0.1, at_s: 3}]", "hang-up needs either rate"),
        ("faults: [{kind: hang-up, rate: 2}]", "rate is 2; a chance is from 0 to 1"),
        ("faults: [{kind: hang-up, at_s: -1}]", "at_s is -1; it must be a number from 0"),
        ("faults: [{kind: hang-up, at_s: soon}]", "at_s is 'soon'"),
        ("faults: [{kind: hang-up, when: 3}]", "is no fault"),
        ("faults: [{kind: silent-servo, rate: 0.1, id: a}]", "id is 'a'; it must be the number of a servo"),
        ("faults: 3", "must hold `faults:`, a list"),
        ("seed: -1\nfaults: []", "seed is -1"),
        ("faults: [", "line 1: no valid YAML"),
    ],
)
def test_bad_plans_are_named(tmp_path, text, message):
    with pytest.raises(HardwareError) as caught:
        plan(tmp_path, text)
    assert message in str(caught.value)


def test_a_missing_plan_is_named(tmp_path):
    with pytest.raises(HardwareError, match=r"cannot read the fault plan .*nowhere\.yaml"):
        load_plan(tmp_path / "nowhere.yaml")
