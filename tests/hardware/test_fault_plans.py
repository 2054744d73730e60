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
    for _ in range(2000):
        changed = faults.byte(b"e,100,100\r\n")
        assert sum(a != b for a, b in zip(changed, b"e,100,100\r\n", strict=True)) == 1
    assert faults.byte(b"") == b""


def test_a_fault_lasts_as_long_as_the_longest_of_its_kind():
    faults = Faults((Fault("hang-up", 0.1, for_s=0.5), Fault("hang-up", at_s=3.0, for_s=1.5), Fault("brown-out", 0.1, for_s=9.0)))
    assert faults.length_s("hang-up") == 1.5
    assert faults.length_s("lost-reply") == 0.0


def test_a_frozen_scene_thaws_and_a_late_tracker_stays_late():
    faults = Faults((Fault("frozen-scene", at_s=1.0, for_s=0.5), Fault("late-tracker", at_s=2.0, for_s=0.25)))
    assert [faults.filmed_s(t_s) for t_s in (0.5, 1.0, 1.25, 1.5, 1.75, 2.0)] == [0.5, 1.0, 1.0, 1.5, 1.75, 1.75]


def test_every_id_that_a_servo_can_have_may_be_silent(tmp_path):
    text = "faults: [{kind: silent-servo, at_s: 1, id: 253}]"
    assert plan(tmp_path, text).faults[0].servo == 253
    with pytest.raises(HardwareError, match="id is 254; it must be the number of a servo, from 0 to 253"):
        plan(tmp_path, text.replace("253", "254"))


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
