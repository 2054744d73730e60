"""What acts only while the robot moves, where commands reach the wheels late: it comes and goes as late, also within a step."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.fit_set import fit_set
from bns.diagnose.predict.wheels import WheelPredictor
from bns.physics.effects import effect_named
from bns.physics.model import Model
from bns.physics.signals import CREEP_M_S, Wheels

STEPS = np.full((1, 50), 0.04)
TOLD = np.repeat([[0.0, 0.3, 0.0, 0.2, 0.0]], 10, axis=1)
MOVES_S = 20 * 0.04


def moving(name, **values):
    return effect_named(name).apply(Wheels(STEPS, TOLD, -TOLD, 0.2), **values).moving


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("command-delay", {"delay_s": 0.013}),
        ("motor-lag", {"tau_s": 0.013}),
        ("motor-lag", {"tau_s": 0.08}),
        ("inertia-lag", {"tau_s": 0.05, "turn_ratio": 0.4}),
        ("lag-mismatch", {"tau_s": 0.05, "ratio": 2.0}),
        ("braking-lag", {"tau_s": 0.05, "brake_ratio": 1.0}),
        ("controller-overshoot", {"tau_s": 0.05, "lead_s": 0.0, "swing_s": 0.025, "turn_ratio": 1.0}),
        ("gear-friction", {"tau_s": 0.013, "turn_ratio": 1.0, "friction_m_s": 0.001, "loss_m_s": 0.0}),
    ],
)
def test_the_robot_moves_no_longer_than_it_is_told_to(name, values):
    """As wheels that follow a command late drive no farther."""
    found = moving(name, **values)
    late_s = next(iter(values.values()))
    assert (found * STEPS).sum() == pytest.approx(MOVES_S, abs=late_s * 0.03)  # the slowest wheels count in part
    assert found[0, 9] == 0
    assert found[0, 10] == pytest.approx(1 - late_s / 0.04, abs=0.05) or late_s > 0.04
    assert found.max() <= 1.0 + 1e-12


def test_wheels_that_slow_down_sooner_end_the_motion_sooner():
    """Of a stop the robot keeps ``brake_s`` of its motion where a start loses ``tau_s``."""
    found = moving("braking-lag", tau_s=0.06, brake_ratio=0.5)
    assert (found * STEPS).sum() == pytest.approx(MOVES_S - 2 * (0.06 - 0.03), abs=0.002)


def test_a_wheel_that_friction_stops_moves_no_longer():
    """From 0.2 m/s it stands after tau·ln(1 + w/f)."""
    stops_s = 0.06 * np.log(1 + 0.2 / 0.1)
    found = moving("gear-friction", tau_s=0.06, turn_ratio=1.0, friction_m_s=0.1, loss_m_s=0.0)[0, 40:]
    assert 0.04 < stops_s < 0.08
    assert found[1] > 0
    assert not found[2:].any()


def test_a_speed_beyond_its_command_moves_the_robot_no_more_than_the_command_does():
    found = moving("controller-overshoot", tau_s=0.01, lead_s=0.0, swing_s=0.05, turn_ratio=1.0)
    assert (found.min(), found.max()) == (0.0, 1.0)
    late = effect_named("controller-overshoot").apply(
        Wheels(STEPS, TOLD, TOLD, 0.2), tau_s=0.01, lead_s=0.0, swing_s=0.05, turn_ratio=1.0
    )
    assert late.left_m_s.max() > 0.35  # it does overshoot
    assert late.left_m_s.min() < -0.05


def test_a_command_that_waits_for_a_tick_moves_the_robot_from_then_on():
    """Ticks of 150 ms: 0.4 s waits for 0.45 s, 0.8 s for 0.9 s."""
    found = moving("command-rate", period_s=0.15)
    np.testing.assert_allclose(found[0, 10:13], [0.0, 0.75, 1.0], atol=1e-12)
    np.testing.assert_allclose(found[0, 20:24], [1.0, 1.0, 0.5, 0.0], atol=1e-12)


def test_a_delay_after_a_lag_shifts_what_the_lag_gave():
    lagged = effect_named("motor-lag").apply(Wheels(STEPS, TOLD, TOLD, 0.2), tau_s=0.06)
    found = effect_named("command-delay").apply(lagged, delay_s=0.08).moving
    np.testing.assert_allclose(found[0, 2:], lagged.moving[0, :-2], atol=1e-12)


def test_wheels_that_stand_do_not_move_whatever_they_were_told():
    lagged = effect_named("motor-lag").apply(Wheels(STEPS, TOLD, TOLD, 0.2), tau_s=0.06)
    stopped = lagged.turning(0 * TOLD, np.full_like(TOLD, CREEP_M_S / 4))
    assert stopped.moving.max() == 0.25
    assert (Wheels(STEPS, TOLD, TOLD, 0.2).moving == (TOLD > 0)).all()


STEP_S, FRAME, BASE_M, BIAS, LATE_S = 0.001, 40, 0.3, 0.05, 0.012


def driven(number, rng, followed):
    """Short moves and rests in steps of 1 ms; the bias follows the command as the wheels do."""
    lasts = rng.integers(8, 23, 16) * FRAME
    speeds = rng.uniform(0.1, 0.5, (2, 16)) * (np.arange(16) % 2 == 0)
    left, right = (np.repeat(speed, lasts) for speed in speeds)
    wheels = [followed(told) for told in (left, right, BIAS * (left > 0))]
    turn = np.concatenate([[0.0], np.cumsum((wheels[1] - wheels[0]) / BASE_M + wheels[2]) * STEP_S])
    middle, way = (turn[1:] + turn[:-1]) / 2, (wheels[0] + wheels[1]) / 2 * STEP_S
    x, y = (np.concatenate([[0.0], np.cumsum(way * direction(middle))]) for direction in (np.cos, np.sin))
    at = np.arange(0, len(left) + 1, FRAME)
    pose = np.column_stack([x, y, turn])[at] + rng.normal(size=(len(at), 3)) * [1e-3, 1e-3, 3e-3]
    now = np.minimum(at, len(left) - 1)
    table = {"trial": number, "t_s": at * STEP_S, "left_m_s": left[now], "right_m_s": right[now]}
    return pd.DataFrame(table | dict(zip(("x_m", "y_m", "heading_rad"), pose.T, strict=True)))


def delayed(told):
    late = round(LATE_S / STEP_S)
    return np.concatenate([np.zeros(late), told[:-late]])


def lagging(told, rise_s=0.08, fall_s=0.08):
    """Of a command that stays in each step: means over the step."""
    out, w = np.empty(len(told)), 0.0
    for i, u in enumerate(told):
        tau_s = rise_s if u > w else fall_s
        kept = np.exp(-STEP_S / tau_s)
        out[i] = u + (w - u) * (1 - kept) * tau_s / STEP_S
        w = u + (w - u) * kept
    return out


def braking(told):
    return lagging(told, fall_s=0.03)


@pytest.mark.parametrize(
    ("followed", "late", "number"),
    [
        (delayed, "command-delay", LATE_S),
        (delayed, "clock-offset", LATE_S),
        (lagging, "motor-lag", 0.08),
        (braking, "braking-lag", 0.08),
    ],
)
def test_a_bias_beside_late_wheels_has_its_number(followed, late, number):
    rng = np.random.default_rng(5)
    table = pd.concat([driven(trial, rng, followed) for trial in range(20)], ignore_index=True)
    names = ("yaw-bias", late)
    _, fit, _ = fit_set(WheelPredictor(tracks_of(table)), Model(wheelbase_m=BASE_M), [effect_named(name) for name in names])
    assert fit.model.values_of("yaw-bias")["rate_rad_s"] == pytest.approx(BIAS, rel=0.02)
    assert next(iter(fit.model.values_of(late).values())) == pytest.approx(number, abs=0.0006)
