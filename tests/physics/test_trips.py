"""Motors that are switched off after large changes of command: by hand, and how limits are guessed from what was seen."""

import numpy as np
import pytest

from bns.physics.effects import effect_named
from bns.physics.effects.overload_trip import changes_and_missing, starts_of
from bns.physics.model import Model
from bns.physics.signals import Conditions, Wheels
from bns.physics.wheels.differential_drive import simulate

B = 0.0884
IDEAL = Model(wheelbase_m=B)


def test_a_motor_is_off_after_a_large_change_of_its_own_command():
    """From rest, too; a second one while it is off restarts the timer; what is commanded then is driven for the rest."""
    model = IDEAL.with_effect("overload-trip", step_m_s=0.15, off_s=0.25)
    left, right, lasts = [0.2, 0.1, 0.3, 0.1, 0.1], [0.1, 0.2, 0.2, 0.2, 0.0], [0.1, 1.0, 0.1, 0.2, 1.0]
    ends = simulate(model, [left], [right], [lasts])[0, :, 2]
    off_left, off_right = [0.1, 0.15, 0.1, 0.2, 0.05], [0.0, 0.0, 0.0, 0.0, 0.25]
    told = zip(left, right, lasts, off_left, off_right, strict=True)
    turned = [(v * (h - off_r) - u * (h - off_l)) / B for u, v, h, off_l, off_r in told]
    assert ends == pytest.approx(np.cumsum(turned))


def test_both_motors_are_off_where_both_changes_add_up():
    model = IDEAL.with_effect("supply-trip", step_m_s=0.25, off_s=0.4)
    ends = simulate(model, [[0.1, 0.2, 0.05]], [[0.1, 0.3, 0.25]], [[1.0, 1.0, 1.0]])[0]
    assert ends[0] == pytest.approx([0.1, 0.0, 0.0])
    assert ends[1, 2] == pytest.approx(0.1 * 0.6 / B)
    assert ends[2, 2] - ends[1, 2] == pytest.approx(0.2 / B)


@pytest.mark.parametrize(("name", "limit"), [("overload-trip", 0.22), ("supply-trip", 0.35)])
def test_a_limit_and_a_time_are_guessed_from_what_was_seen_or_not_at_all(name, limit):
    """Commands of 2 s in steps of 0.1 s; a tracker that saw the wheels stand for 0.4 s after a change beyond the limit."""
    guess, rng = effect_named(name).starts_from, np.random.default_rng(3)
    told = np.repeat(rng.uniform(-0.3, 0.3, (2, 4, 30)), 20, axis=2)
    changed = np.abs(np.diff(told, axis=2, prepend=0.0))
    trips = (changed if name == "overload-trip" else np.broadcast_to(changed.sum(axis=0), changed.shape)) > limit
    off = np.logical_or.reduce([np.roll(trips, by, axis=2) for by in range(4)])
    off[..., :3] = trips[..., :1]
    left, right = np.where(off, 0.0, told)
    step = np.full(left.shape, 0.1)
    heading = np.cumsum((right - left) / B * step, axis=1) - (right - left) / B * step / 2
    ahead = (left + right) / 2 * step
    x, y = (np.cumsum(ahead * f(heading), axis=1) - ahead * f(heading) / 2 for f in (np.cos, np.sin))
    seen = np.stack([x, y, heading], axis=2)
    starts = guess(Wheels(step, *told, B, Conditions(seen=seen)))
    assert min(abs(start[0] - limit) for start in starts) < 0.02
    assert min(abs(start[1] - 0.4) for start in starts) < 0.06
    assert 1 < len(starts) <= 4
    assert guess(Wheels(step, *told, B)) == ()
    assert guess(Wheels(step, *np.zeros_like(told), B, Conditions(seen=seen))) == ()


def test_no_limit_lies_between_equal_changes_and_none_where_nothing_is_missing():
    sizes, speed = np.array([0.3, 0.1, 0.3, 0.1]), np.ones(4)
    limits = [start[0] for start in starts_of(sizes, speed, np.array([0.2, 0.0, 0.0, 0.0]))]
    assert sorted(limits) == pytest.approx([0.05, 0.2])
    assert starts_of(sizes, speed, np.full(4, -0.1)) == ()


@pytest.mark.parametrize(("stood_from", "missing_m"), [(3, 0.1), (15, 0.0)])
def test_what_is_missing_later_than_a_second_after_a_change_has_another_cause(stood_from, missing_m):
    """One command of 4 s in steps of 0.1 s; both wheels stood for half a second."""
    step, told = np.full((1, 40), 0.1), np.full((1, 40), 0.2)
    drove = told.copy()
    drove[0, stood_from : stood_from + 5] = 0.0
    at = np.cumsum(drove * step, axis=1) - drove * step / 2
    seen = np.stack([at, np.zeros_like(at), np.zeros_like(at)], axis=2)
    by, speed, missing = changes_and_missing(Wheels(step, told, told, B, Conditions(seen=seen)))
    assert by.tolist() == speed.tolist() == [[0.2], [0.2]]
    assert missing == pytest.approx(np.full((2, 1), missing_m), abs=1e-9)
