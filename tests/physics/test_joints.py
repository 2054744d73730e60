"""A wheel loses way at each joint that it crosses, from whichever side; where rows of them are is seen in what was tracked."""

import math

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.predict.wheels import WheelPredictor
from bns.physics.effects import effect_named
from bns.physics.model import Model
from bns.physics.wheels.differential_drive import simulate
from bns.physics.wheels.joints import Joints
from tests.diagnose.residuals.test_floor_lines import driven
from tests.diagnose.worlds import NOMINAL, hidden, measured

SLOW_M_S, LOSS_M = 0.1, 0.004
PLANKS = {"spacing_m": 0.1, "across_rad": 0.0, "at_m": 0.05, "loss_m": LOSS_M, "over_m": 0.01}


def ended(start, left=SLOW_M_S, right=SLOW_M_S, time_s=3.1, effect="floor-joints", **values):
    model = Model(wheelbase_m=0.1).with_effect(effect, **{**PLANKS, **values})
    return simulate(model, np.array([[left]]), np.array([[right]]), np.array([[time_s]]), start=start)[0, -1]


@pytest.mark.parametrize(("heading", "way"), [(0.0, 1.0), (math.pi, -1.0)])
@pytest.mark.parametrize("speed", [SLOW_M_S, -SLOW_M_S])
def test_a_robot_is_short_by_what_its_wheels_lose_at_each_joint(heading, way, speed):
    """0.31 m across joints every 0.1 m from 0.05 m on: three of them, whichever way it heads and drives."""
    x, y, turned = ended((0.0, 0.0, heading), left=speed, right=speed)
    assert x == pytest.approx(math.copysign(0.31 - 3 * LOSS_M, way * speed), abs=2e-4)
    assert (y, turned) == pytest.approx((0.0, heading), abs=1e-9)


def test_at_an_angle_it_loses_as_much_a_joint_and_turns_where_one_wheel_crosses_first():
    """Along 45° the left wheel comes 0.1 m · sin 45° later in x; both lose the same in the end."""
    start = (0.0, 0.0, math.pi / 4)
    x, y, turned = ended(start, time_s=0.42 / SLOW_M_S)
    crossed = round(0.42 * math.cos(math.pi / 4) / 0.1)
    assert math.hypot(x, y) == pytest.approx(0.42 - crossed * LOSS_M, abs=LOSS_M)
    assert turned == pytest.approx(math.pi / 4, abs=0.05)
    one = ended((0.0, 0.0, math.pi / 4), time_s=0.06 / SLOW_M_S)  # the right wheel is past x = 0.05, the left one is not
    assert one[2] == pytest.approx(math.pi / 4 - LOSS_M / 0.1, abs=0.004)


def test_along_a_joint_and_between_two_nothing_is_lost():
    assert ended((0.0, 0.0, 0.0), across_rad=math.pi / 2, at_m=0.08)[:2] == pytest.approx([0.31, 0.0], abs=1e-9)
    assert ended((0.06, 0.0, 0.0), time_s=0.5)[0] == pytest.approx(0.11, abs=1e-9)


def test_a_wheel_never_runs_backwards_at_a_joint():
    way = ended((0.0, 0.0, 0.0), loss_m=0.05, time_s=1.0)[0]
    assert 0.0 < way < 0.1


def test_tiles_have_a_second_row_across_the_first():
    second = {"second_at_m": 0.05, "second_share": 0.5, "effect": "floor-tiles"}
    assert ended((0.0, 0.0, 0.0), **second)[0] == pytest.approx(0.31 - 3 * LOSS_M, abs=2e-4)
    assert ended((0.0, 0.0, math.pi / 2), **second)[1] == pytest.approx(0.31 - 3 * LOSS_M / 2, abs=2e-4)


def test_how_many_joints_lie_behind():
    row = Joints(0.0, 0.1, 0.02, 0.01)
    behind = row.passed(np.array([0.0, 0.02, 0.0225, 0.05, 0.12, 0.125, 0.21]))
    assert behind - behind[0] == pytest.approx([0.0, 0.5, 0.75, 1.0, 1.5, 2.0, 2.0])


def starts(name, table):
    return WheelPredictor(tracks_of(table)).starts_of(effect_named(name), NOMINAL)


def test_a_row_is_found_with_its_spacing_its_direction_and_its_place():
    found = starts("floor-joints", driven([(math.radians(-60), 0.13, 0.05)], 0.003))
    (spacing, across, at, loss, _), *others = found
    assert not others
    assert spacing == pytest.approx(0.13, abs=0.001)
    assert math.degrees(across) == pytest.approx(-60, abs=0.5)
    assert at == pytest.approx(0.05, abs=0.003)
    assert loss == pytest.approx(0.003, rel=0.15)


def test_both_rows_of_tiles_are_found():
    """From either row: the other is a quarter turn to the left of it."""
    found = starts("floor-tiles", driven([(math.radians(20), 0.2, 0.05), (math.radians(110), 0.2, 0.08)], 0.004))
    assert len(found) == 2
    for spacing, across, at, loss, _, second_at, share in found:
        assert spacing == pytest.approx(0.2, abs=0.002)
        turned = abs(math.degrees(across) - 20) < 1.0
        assert turned or math.degrees(across) == pytest.approx(-70, abs=1.0)
        wanted = (0.05, 0.08) if turned else (-0.08, 0.05)
        off = [(is_at - there + 0.1) % 0.2 - 0.1 for is_at, there in zip((at, second_at), wanted, strict=True)]
        assert off == pytest.approx([0.0, 0.0], abs=0.006)
        assert loss == pytest.approx(0.004, rel=0.3)  # where a fit begins
        assert share == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize(
    "table",
    [
        lambda: driven([], 0.0),
        lambda: driven([(0.0, 10.0, 0.1)], -0.006),  # a single line has no spacing
        lambda: driven([], 0.0, dragged=lambda pose, _: np.where(np.abs(pose[:, 0]) < 0.2, 0.9, 1.0)),
        lambda: measured(hidden(wheel_eccentricity={"left_share": 0.03, "right_share": 0.03, "turn_m": 0.13}), trials=30),
        lambda: measured(hidden(motor_lag={"tau_s": 0.2}), trials=30, commands=10),
    ],
)
def test_elsewhere_there_is_no_row_and_the_effect_begins_from_nothing(table):
    (start,) = starts("floor-joints", table())
    assert start == tuple(effect_named("floor-joints").neutral.values())
