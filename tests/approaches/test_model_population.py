"""Models that are bred: the drawing is among the first, the better half of parents and children goes on."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.approaches.parts.model_population import ModelPopulation

LOW, HIGH = np.array([-2.0, -1.0, -3.0]), np.array([2.0, 4.0, 3.0])
TARGET = np.array([1.0, 3.0, -2.0])
SPACE = SimpleNamespace(
    size=3, effects=("a", "b"), bounds=(LOW, HIGH), model=lambda point, active: (np.array(point), np.array(active))
)


def off(model):
    """How far a model is from the one that is looked for."""
    return float(np.abs(model[0] - TARGET).sum())


def test_the_drawing_is_the_first_model_and_has_no_effect_where_these_are_free():
    for free, on in ((False, True), (True, False)):
        some = ModelPopulation(SPACE, 40, np.random.default_rng(0), free)
        point, active = some.model(0)
        assert not point.any()
        assert (active == on).all()
    assert 0.3 < some.active.mean() < 0.7


def test_models_are_ranked_by_error_and_what_is_no_number_is_last():
    some = ModelPopulation(SPACE, 5, np.random.default_rng(0))
    some.points[:, 0] = [3.0, 1.0, np.nan, 0.0, 1.0]
    some.points[:, 1] = np.arange(5)
    some.judge(lambda model: model[0][0])
    assert some.points[:, 1].tolist() == [3, 1, 4, 0, 2]
    assert some.best[0][1] == 3


def test_generations_end_near_the_model_that_is_looked_for_and_never_lose_the_best():
    random = np.random.default_rng(1)
    some = ModelPopulation(SPACE, 20, random)
    some.judge(off)
    for _ in range(40):
        before = some.errors.copy()
        some.breed(off, random)
        assert len(some) == 20
        assert (some.errors <= before).all()
        assert (np.diff(some.errors) >= 0).all()
    assert some.errors[0] == pytest.approx(off(some.best))
    assert some.errors[0] < 0.3
    assert (some.points >= LOW).all()
    assert (some.points <= HIGH).all()


def test_of_two_models_in_a_tournament_the_one_of_the_better_rank_wins():
    some = ModelPopulation(SPACE, 1000, np.random.default_rng(2))
    ranks = some._winners(np.random.default_rng(3))
    assert ranks.mean() == pytest.approx(1000 / 3, rel=0.05)
