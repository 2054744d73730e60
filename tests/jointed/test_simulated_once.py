"""No stretch of a body is simulated twice with the same plant; what cannot be foreseen is simulated no further."""

from dataclasses import replace

import numpy as np
import pytest

from bns.diagnose.data.bodies.cycles import checked_cycles, cycle_tracks
from bns.diagnose.data.bodies.stretches import stretches_of_cycles
from bns.diagnose.predict import jointed
from bns.diagnose.predict.jointed import JointedPredictor
from bns.diagnose.predict.stretches import Simulations, _Level
from bns.physics.jointed.model_files import load_body
from bns.physics.jointed.plant import Rough
from tests.hidden_snake.body import Hidden
from tests.hidden_snake.worlds import World, driven

SNAKE = load_body("snake")


@pytest.fixture(scope="module")
def tracks():
    return stretches_of_cycles(
        cycle_tracks(checked_cycles(driven(World("x", "none", Hidden(), ()), 1, 4, 2))[0]), SNAKE.mechanism, 12
    )


@pytest.fixture
def asked(monkeypatch):
    """(step in s, stretches) of everything that is simulated."""
    found, usual = [], _Level._simulated

    def counted(self, plant, stretches):
        found.append((self.simulator.machine.model.opt.timestep, stretches.tolist()))
        return usual(self, plant, stretches)

    monkeypatch.setattr(_Level, "_simulated", counted)
    return found


def test_what_was_simulated_of_some_stretches_is_not_simulated_again_of_all(tracks, asked):
    whole = Simulations.of(tracks, SNAKE.mechanism)
    some = np.array([0, len(whole) - 1])
    plant = replace(whole.plant, friction_along=1.3, friction_across=1.3)
    of_few = whole.only(some).seen_of(plant)
    assert [which for _, which in asked] == [some.tolist()]
    of_all = whole.seen_of(plant)
    assert [which for _, which in asked] == [some.tolist(), list(range(1, len(whole) - 1))]
    np.testing.assert_array_equal(of_all[whole.looks_of(some)], of_few)
    np.testing.assert_array_equal(whole.seen_of(replace(plant)), of_all)
    assert len(asked) == 2
    fresh = Simulations.of(tracks, SNAKE.mechanism).seen_of(plant)
    np.testing.assert_allclose(of_all, fresh, atol=1e-9)


def test_plants_that_differ_in_anything_are_told_apart():
    plant = load_body("snake").plant
    others = [
        replace(plant, sag=0.1),
        replace(plant, slope=(0.0, 0.01)),
        replace(plant, slope=(0.01, 0.0)),
        replace(plant, rough=(Rough(0.0, 0.0, 0.5, 0.7),)),
        replace(plant, rough=(Rough(0.0, 0.0, 0.5, 0.7, disc=False),)),
        replace(plant, rough=(Rough(0.0, 0.0, 0.5, 0.7), Rough(0.0, 0.0, 0.5, 0.7))),
        plant.with_link("grip", 3, 2.0),
        plant.with_link("mass", 3, 2.0),
        *(plant.with_joint(values, "joint4", 0.5) for values in ("stiffness", "torque", "zero_rad", "damping")),
    ]
    assert len({one.key for one in (plant, *others)}) == len(others) + 1
    assert replace(plant).key == plant.key


def test_wild_stretches_are_left_out_before_they_are_simulated_finely(tracks, asked, monkeypatch):
    monkeypatch.setattr(jointed, "_far_m", lambda simulations, bare: np.r_[1.0, np.zeros(len(simulations) - 1)])
    predictor = JointedPredictor(tracks, SNAKE)
    assert predictor.left_out == 1
    there = len(tracks.told)
    assert len(predictor.windows("cycle")[0]) == there - 1
    fine = min(dt for dt, _ in asked)
    assert [which for dt, which in asked if dt == fine] == [list(range(1, there))]


@pytest.mark.slow
def test_a_model_is_worked_out_finely_where_numbers_are_settled(tracks, asked):
    predictor = JointedPredictor(tracks, SNAKE)
    model = SNAKE.with_effect("floor-friction", factor=1.5)
    fine = min(dt for dt, _ in asked)
    asked.clear()
    assert predictor.anchor(model)
    assert [len(which) for dt, which in asked if dt == fine] == [len(predictor.windows("cycle")[0])]
    np.testing.assert_array_equal(predictor._responses.seen(model), predictor._simulations.exactly(model))
    asked.clear()
    assert predictor.screening is None or predictor.screening.anchor(model)
    assert all(dt > fine for dt, _ in asked)


def test_only_stretches_that_come_to_a_place_of_the_floor_are_simulated_on_it(tracks, monkeypatch):
    simulations, simulated = Simulations.of(tracks, SNAKE.mechanism), []
    usual = _Level._all_simulated

    def counted(self, plant, stretches):
        simulated.append(stretches.tolist())
        return usual(self, plant, stretches)

    level = simulations.seen_of(simulations.plant)
    monkeypatch.setattr(_Level, "_all_simulated", counted)
    edge_m = float(np.median(tracks.pose[tracks.begins, 0])) + 0.45
    patch = replace(simulations.plant, rough=(Rough(edge_m + 3.0, 0.0, 3.0, 0.7),))
    on_it = simulations.seen_of(patch)
    assert 0 < len(simulated[-1]) < len(simulations)
    np.testing.assert_array_equal(simulations.seen_of(replace(patch, rough=(Rough(50.0, 0.0, 1.0, 0.7),))), level)
    assert len(simulated) == 1
    every = _Level._all_simulated(simulations._body.coarse, patch, np.arange(len(simulations)))
    np.testing.assert_allclose(on_it, every, atol=1e-9)
    assert np.abs(on_it - level).max() > 5e-3
