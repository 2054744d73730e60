"""What a run gives its approach: shares of its evaluations, and draws that are the approach's own."""

import numpy as np
import pytest

from bns.approaches.parts.base import Setting
from bns.engine.philox import Key
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task

ROBOT, TASK, KEY = load_robot("khepera"), load_task("khepera", "circle"), Key(3, 4)


def setting(evaluations=10, key=KEY, **options):
    return Setting(ROBOT, TASK, key, RunSpec(evaluations=evaluations), options)


@pytest.mark.parametrize(
    ("share", "evaluations", "expected"),
    [(0.3, 10, 3), (0.3, 9, 3), (0.28, 10, 3), (0.22, 10, 2), (0.0, 10, 1), (1.0, 10, 9), (1.0, 2, 1), (1.0, 1, 1), (0.0, 1, 1)],
)
def test_a_share_is_the_nearest_whole_number_with_one_at_least_on_either_side(share, evaluations, expected):
    assert setting(evaluations, data=share).share("data") == expected


def test_every_step_has_draws_of_its_own_that_come_back():
    several = setting(), setting(key=Key(3, 5)), setting(key=Key(4, 4))
    draws = [tuple(one.generator(step).random(5)) for one in several for step in (0, 1, 2)]
    assert len({number for one in draws for number in one}) == 45
    assert draws[1] == tuple(setting(evaluations=20).generator(1).random(5))


def test_keys_of_different_draws_are_different_and_none_is_that_of_the_run():
    one = setting(key=Key.of_run(0, 0, "khepera", "circle"))
    keys = [one.own_key("test 1"), one.own_key("test 2"), one.own_key("robot"), one.key]
    assert len(set(keys)) == 4
    assert one.own_key("robot") == keys[2]
    assert np.unique([key.words for key in keys], axis=0).shape[0] == 4
