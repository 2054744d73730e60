"""How long stops take, a few of each robot; `python -m tests.hardware.stops` measures more of them."""

import numpy as np
import pytest

from .. import stops


def still_s(robot, count, causes, **driver):
    found = stops.measured(robot, count, causes, **driver)
    return np.array([stop.still_s for of_a_cause in found.values() for stop in of_a_cause])


def test_a_khepera_stands_within_the_aim(tmp_path):
    """Whatever ended the drive: from full speed the wheels themselves take 130 ms."""
    causes = ["end of the commands", "stop asked for", "off the surface", "lost-marker", "brown-out"]
    took_s = still_s("khepera", 4, causes)
    assert took_s.max() <= stops.AIM_S + 1e-6
    assert took_s.min() > 0.04  # two readings


def test_lost_answers_cost_a_khepera_s_stop_little(tmp_path):
    took_s = still_s("khepera", 5, ["lost-request", "lost-reply", "corrupt-reply", "bus-fault"])
    assert np.median(took_s) <= stops.AIM_S + 1e-6
    assert took_s.max() <= stops.AIM_S + 0.04


def test_a_khepera_whose_line_was_gone_is_stopped_once_it_is_back(tmp_path):
    """A thread that answers on the emulated line must notice that it is back; a busy machine lets some wait for that."""
    assert still_s("khepera", 5, ["hang-up"]).min() <= stops.AIM_S + 0.04


@pytest.mark.parametrize(("wiring", "cause"), [("bus", "silent-servo"), ("bus", "overload"), ("bridge", "stop asked for")])
def test_a_snake_s_servos_are_off_at_once(tmp_path, wiring, cause):
    """And nothing moves any more soon after, but what was lifted and sinks."""
    found = stops.measured("snake", 2, [cause], wiring=wiring)[cause]
    assert max(stop.taken_s for stop in found) <= 0.1
    assert np.median([stop.still_s for stop in found]) <= stops.AIM_S
