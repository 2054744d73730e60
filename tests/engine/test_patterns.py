"""What the networks learn from: the split, growth, and what is not finite."""

import numpy as np

from bns.bootstrap.trainer import Trainer
from bns.engine.patterns import TRAINING_SHARE, PatternSet, TrainingData
from bns.engine.philox import Key
from bns.robots import load_robot
from bns.spec import RunSpec


def numbered(first, n):
    """Patterns that can be told apart: the number of a pattern is in all of its values."""
    numbers = np.arange(first, first + n, dtype=np.float32)
    return np.tile(numbers, (5, 1)), np.stack([numbers, -numbers, 2 * numbers])


def filled(evaluations, per=10, seed=0):
    data = TrainingData.empty(5, 3)
    for evaluation in range(1, evaluations + 1):
        assert data.add(*numbered(per * (evaluation - 1), per), Key(seed, 7), evaluation) == 0
    return data


def numbers(patterns):
    X, y = patterns.inputs[:, : patterns.count], patterns.targets[:, : patterns.count]
    assert (X[0] == X).all()
    np.testing.assert_array_equal(y, [X[0], -X[0], 2 * X[0]])  # inputs and targets stay together
    return X[0]


def test_every_pattern_goes_to_one_of_the_sets():
    data = filled(200)
    both = np.concatenate([numbers(data.training), numbers(data.validation)])
    np.testing.assert_array_equal(np.sort(both), np.arange(2000))


def test_three_quarters_train():
    share = filled(400).training.count / 4000
    assert abs(share - TRAINING_SHARE) < 4 * np.sqrt(0.75 * 0.25 / 4000)
    assert TRAINING_SHARE == 0.75


def test_the_split_is_of_its_seed():
    np.testing.assert_array_equal(numbers(filled(20).training), numbers(filled(20).training))
    assert set(numbers(filled(20, seed=1).training)) != set(numbers(filled(20).training))


def test_more_patterns_than_there_was_room_for():
    patterns = PatternSet.empty(5, 3)
    room = patterns.inputs.shape[1]
    for first in range(0, 5 * room, room // 2 + 1):
        patterns.add(*numbered(first, room // 2 + 1))
    np.testing.assert_array_equal(numbers(patterns), np.arange(patterns.count))
    patterns.add(*numbered(patterns.count, 7 * room))
    np.testing.assert_array_equal(numbers(patterns), np.arange(patterns.count))


def test_a_pattern_that_a_network_may_not_learn_from_stays_so_however_often_it_counts():
    patterns, present = PatternSet.empty(5, 3), np.ones((3, 4), bool)
    present[1, 2] = False
    patterns.add(*numbered(0, 4), present)
    merged = patterns.counted(np.array([1, 0, 3, 2])).merged()
    assert [(inputs[0].tolist(), counts.tolist()) for inputs, _, counts in merged] == [
        ([0, 2, 3], [1, 3, 2]), ([0, 3], [1, 2]), ([0, 2, 3], [1, 3, 2]),
    ]  # fmt: skip
    assert patterns.present[:, :4].tolist() == present.tolist()


def test_what_is_not_finite_is_left_out_and_counted():
    X, y = numbered(0, 40)
    X[2, 3], y[0, 5], y[2, 6], y[1, 6] = np.nan, np.inf, -np.inf, np.nan
    data = TrainingData.empty(5, 3)
    assert data.add(X, y, Key(0, 0), 1) == 3
    kept = np.concatenate([numbers(data.training), numbers(data.validation)])
    np.testing.assert_array_equal(np.sort(kept), [i for i in range(40) if i not in (3, 5, 6)])


def test_one_bad_pattern_does_not_move_the_others_between_the_sets():
    X, y = numbered(0, 40)
    whole, holed = TrainingData.empty(5, 3), TrainingData.empty(5, 3)
    whole.add(X, y, Key(0, 0), 1)
    bad = y.copy()
    bad[0, 11] = np.nan
    holed.add(X, bad, Key(0, 0), 1)
    assert set(numbers(holed.training)) == set(numbers(whole.training)) - {11}


def test_nothing_added_is_nothing_there():
    data = TrainingData.empty(5, 3)
    data.add(*numbered(0, 0), Key(0, 0), 1)
    assert (data.training.count, data.validation.count) == (0, 0)


def test_what_is_forgotten_takes_along_who_may_learn_from_it():
    X, y = numbered(0, 12)
    present = np.random.default_rng(5).uniform(size=y.shape) < 0.5
    patterns = PatternSet.empty(5, 3)
    patterns.add(X, y, present)
    patterns.forget(5)
    np.testing.assert_array_equal(numbers(patterns), np.arange(5, 12))
    np.testing.assert_array_equal(patterns.present[:, : patterns.count], present[:, 5:])


def test_the_error_is_of_the_patterns_that_a_network_may_learn_from():
    X, y = numbered(0, 6)
    present = np.arange(6) < np.array([[6], [4], [0]])
    errors = []
    for elsewhere in (0.0, 1e6):
        trainer = Trainer.start(load_robot("khepera"), Key(0, 0), RunSpec())
        trainer.data.training.add(X, np.where(present, y, np.float32(elsewhere)), present)
        errors.append(trainer.errors()[0])
    assert errors[0] == errors[1] > 0
