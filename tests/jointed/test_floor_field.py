"""An effect of a body that only imitates a rough place of the floor gives way to it; one that does not stays."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose import standing
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.predict.jointed import JointedPredictor
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.floor_field import imitating_floor
from bns.diagnose.select.result import Candidate, SelectionResult, SelectionStep
from bns.physics.jointed.model_files import load_body

SNAKE = load_body("snake")
TRIALS, FRAMES = 40, 4
LINK, FRICTION = "link-friction-link12", "floor-friction"


class Tracks(SimpleNamespace):
    def __len__(self):
        return TRIALS


def problem_of(link_is_place, effect=LINK, rough=0.7, own=1.0):
    """A problem on a floor with a rough place; an effect that does what the place does, or something of its own (``own``)."""
    rng = np.random.default_rng(3)
    tents = rng.normal(size=(9, TRIALS * FRAMES, 3))
    place = {f"floor-tent-{i}-{j}": 3 * (i + 1) + j + 1 for i in (-1, 0, 1) for j in (-1, 0, 1)}
    link = tents[8] + 0.1 * tents[5] if link_is_place else rng.normal(size=tents[0].shape)
    if effect == FRICTION:
        link = tents.sum(axis=0)
    measured = rough * tents[8] + (0.0 if link_is_place else own) * link + 0.5 * rng.normal(size=link.shape)

    def whitened(model):
        left = measured.copy()
        for active in model.effects:
            if active.effect.name in place:
                left -= active.values[0] * tents[place[active.effect.name]]
            elif active.effect.name == effect:
                left -= np.log(active.values[0]) * link
        return left

    predictor = object.__new__(JointedPredictor)
    predictor._bare, predictor.luck = SNAKE, None
    trial = np.repeat(np.arange(TRIALS), FRAMES)
    predictor.tracks = Tracks(first=np.arange(TRIALS + 1) * FRAMES, trial=trial, extra={})
    problem = Problem(predictor, None)
    problem.whitened = whitened
    return problem, problem.fit(SNAKE.with_effect(effect, factor=2.0))


def test_a_link_that_does_what_a_rough_place_does_gives_way():
    problem, fit = problem_of(link_is_place=True)
    assert fit.model.values_of(LINK)["factor"] == pytest.approx(2.0, rel=0.1)
    assert imitating_floor(problem, fit, (LINK,)) == (LINK,)


@pytest.mark.parametrize(("effect", "rough"), [(LINK, 0.7), (LINK, 0.0), (FRICTION, 0.0), (FRICTION, 0.7)])
def test_a_real_effect_stays_with_and_without_a_rough_place(effect, rough):
    problem, fit = problem_of(link_is_place=False, effect=effect, rough=rough)
    assert imitating_floor(problem, fit, (effect,)) == ()


def test_wheels_have_no_field_and_are_not_asked(monkeypatch):
    monkeypatch.setattr(standing, "imitating_floor", None)
    stands = SimpleNamespace(selection=None, rest=SimpleNamespace(any=True))
    wheels = object.__new__(WheelPredictor)
    assert standing.beside_the_floor(stands, wheels, None, None) == (stands, ())


def test_an_explanation_without_what_imitates_takes_its_place(monkeypatch):
    problem, fit = problem_of(link_is_place=True)
    bare = problem.fit(SNAKE)
    patch = (1.0, 0.0, 0.5, 2.0)
    monkeypatch.setattr(standing, "fit_with", lambda problem, fit, effect, known: problem.fit(known, rounds=0))
    found = SimpleNamespace(model=SNAKE.with_active(SNAKE.effect_named("floor-patch"), patch))
    step = SelectionStep((Candidate("floor-patch", found, None),), 0.0, LINK)
    selection = SelectionResult(problem, bare, fit, (LINK,), (step,), (("floor-patch",),))
    monkeypatch.setattr(SelectionResult, "only", lambda self, names: SelectionResult(problem, bare, bare, names, self.steps))
    monkeypatch.setattr(standing, "standing_of", lambda selection, *_: selection)
    stands = SimpleNamespace(selection=selection, rest=SimpleNamespace(any=True))
    other, lost = standing.beside_the_floor(stands, problem.predictor, SNAKE, lambda _: None)
    assert lost == (LINK,)
    assert other.accepted == ("floor-patch",)
    assert tuple(other.fit.model.values_of("floor-patch").values()) == patch
    nothing = SelectionResult(problem, bare, fit, (LINK,), (step,))
    stands = SimpleNamespace(selection=nothing, rest=SimpleNamespace(any=True))
    assert standing.beside_the_floor(stands, problem.predictor, SNAKE, lambda _: None)[0].accepted == ()
    stands = SimpleNamespace(selection=selection, rest=SimpleNamespace(any=False))
    assert standing.beside_the_floor(stands, problem.predictor, SNAKE, None) == (stands, ())
