"""What a person reads where formulas have bare names."""

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report.variables import LABELS, label
from bns.robots.snake.table import GAIT
from tests.diagnose.worlds import NOMINAL, measured


def test_every_variable_of_a_robot_with_wheels_has_words_of_its_own():
    names = WheelPredictor(tracks_of(measured(NOMINAL, trials=2))).variables()
    assert names
    assert not [name for name in names if name not in LABELS]


def test_so_has_every_number_of_a_cycle():
    assert not [name for name in (*GAIT, *(f"previous_{name}" for name in GAIT), "cycle", "change") if name not in LABELS]


def test_no_two_variables_read_alike():
    assert len(set(LABELS.values())) == len(LABELS)


def test_a_logged_column_keeps_its_own_name():
    assert label("battery_v") == "battery_v"
