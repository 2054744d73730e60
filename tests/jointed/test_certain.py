"""An effect of a body that is certain by curves alone: the body is simulated itself, and asked for as much there."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose import standing
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.select.result import SelectionResult, SelectionStep
from bns.diagnose.standing import least_certain, may_be_neutral
from bns.physics.jointed.model_files import load_body

SNAKE = load_body("snake")
TRIALS, TRIED = 40, 100
ZEROS = np.zeros((TRIALS, 3))
OF_TRIALS = np.zeros(TRIALS)


def found(luck="luck", **numbers):
    """A search that accepted offsets of joints' zeros: value and half of the 95 % interval of each, None for no interval."""
    names = [f"joint-zero-{joint}" for joint in numbers]
    free = tuple(FreeParameter(name, SNAKE.catalogue()[name].parameters[0]) for name in names)
    model = SNAKE
    for name, (value, _) in zip(names, numbers.values(), strict=True):
        model = model.with_effect(name, offset_rad=value)
    spans = {j: (v - half, v + half) for j, (v, half) in enumerate(numbers.values()) if half is not None}
    values = np.array([value for value, _ in numbers.values()])
    fit = Fit(model, free, values, np.eye(len(free)), OF_TRIALS, OF_TRIALS, ZEROS, np.zeros((TRIALS, 3, len(free))), spans)
    problem = SimpleNamespace(predictor=SimpleNamespace(luck=luck))
    return SelectionResult(problem, fit, fit, tuple(names), (SelectionStep((), 0.0, "", of=TRIED),))


def changed(fell, after=0.5):
    """Errors that fall to a share of those of the model as given, for certain or perhaps."""
    models = [SimpleNamespace(rms_m=1.0), SimpleNamespace(rms_m=after)]
    at = SimpleNamespace(windows=0, total=SimpleNamespace(fell=fell), models=models)
    return SimpleNamespace(falls=True, horizons={"stretch": at})


@pytest.mark.parametrize(
    ("errors", "luck", "ends"),
    [
        ({"tether-pull": (False, 0.8), "floor-slope": (True, 0.56), "dead-band": (True, 0.6)}, "luck", "floor-slope"),
        ({"tether-pull": (True, 0.8), "floor-slope": (True, 0.56)}, "luck", "tether-pull"),  # certain, so nothing is asked
        ({"tether-pull": (False, 0.8), "floor-slope": (False, 0.5)}, "luck", "tether-pull"),
        ({"tether-pull": (False, 0.5), "floor-slope": (True, 0.56)}, "luck", "tether-pull"),
        ({"tether-pull": (False, 0.8), "floor-slope": (True, 0.56)}, None, "tether-pull"),  # wheels are no curves
        ({"tether-pull": (False, 0.8), "compliance": (True, 0.56)}, "luck", "tether-pull"),  # the fourth of them
        ({"tether-pull": (False, 0.8), "payload": (True, 0.56)}, "luck", "tether-pull"),  # not considered
    ],
)
def test_where_the_error_may_not_fall_the_best_alone_are_simulated(monkeypatch, errors, luck, ends):
    names = ("payload", "tether-pull", "floor-slope", "dead-band", "clock-drift", "compliance")
    ranking = tuple(SimpleNamespace(name=name, rejected_because="absurd" if name == "payload" else "") for name in names)
    monkeypatch.setattr(SelectionResult, "withdrawn", lambda self: replace(self, accepted=()))
    monkeypatch.setattr(standing, "least_certain", lambda _: "")
    monkeypatch.setattr(standing, "may_be_neutral", lambda _: "")
    monkeypatch.setattr(standing, "refitted", lambda selection, *_: selection)
    monkeypatch.setattr(standing, "explained_by", lambda selection, accepted: replace(selection, accepted=accepted))
    monkeypatch.setattr(
        standing, "errors_before_and_after", lambda selection, _: changed(*errors.get(selection.accepted[0], (False, 0.9)))
    )
    monkeypatch.setattr(standing, "residual_dependence", lambda *_: [])
    monkeypatch.setattr(standing, "unexplained", lambda *_: None)
    problem = SimpleNamespace(predictor=SimpleNamespace(luck=luck))
    searched = SelectionResult(problem, None, None, ("tether-pull",), (SelectionStep(ranking, 0.0, "", of=6),))
    assert standing.standing_of(searched, None, SNAKE, lambda _: None).selection.accepted == (ends,)


def test_of_a_hundred_that_were_tried_one_must_be_told_from_neutral_a_hundred_times_as_surely():
    """Student's t of 38 and more degrees of freedom: 2.0 at 5 %, 3.7 at 0.05 %, so 1.8 halves of an interval of 95 %."""
    sure = {"joint7": (0.095, 0.008)}
    assert least_certain(found(**sure)) == ""
    assert least_certain(found(**sure, joint10=(0.0257, 0.0243))) == "joint-zero-joint10"
    assert least_certain(found(**sure, joint10=(-0.0257, 0.0150))) == "joint-zero-joint10"
    assert least_certain(found(**sure, joint10=(-0.0257, 0.0130))) == ""
    assert least_certain(found(joint2=(0.02, 0.015), joint10=(0.02, 0.019))) == "joint-zero-joint10"


def test_only_numbers_for_which_the_body_was_simulated_are_asked():
    assert least_certain(found(joint10=(0.02, None))) == ""


def test_what_cannot_be_told_from_neutral_is_found_the_last_first(monkeypatch):
    searched = found(luck=None, joint2=(0.02, None), joint7=(0.02, None), joint10=(0.02, None))
    assert may_be_neutral(searched) == "joint-zero-joint10"  # 0.02 with a standard error of 1
    assert may_be_neutral(replace(searched, fit=replace(searched.fit, covariance=1e-6 * np.eye(3)))) == ""
    monkeypatch.setattr(standing, "does_nothing", lambda _fit, name: name != "joint-zero-joint10")
    assert may_be_neutral(searched) == "joint-zero-joint7"


def test_what_cannot_be_told_from_neutral_does_not_stand(monkeypatch):
    left = iter(["yaw-bias", "wheelbase", ""])
    monkeypatch.setattr(standing, "least_certain", lambda _: "")
    monkeypatch.setattr(standing, "may_be_neutral", lambda _: next(left))
    monkeypatch.setattr(standing, "refitted", lambda selection, *_: selection)
    monkeypatch.setattr(SelectionResult, "lacking", lambda self, names: replace(
        self, accepted=tuple(n for n in self.accepted if n not in names)
    ))  # fmt: skip
    monkeypatch.setattr(standing, "errors_before_and_after", lambda selection, _: changed(True, len(selection.accepted)))
    monkeypatch.setattr(standing, "residual_dependence", lambda *_: [])
    monkeypatch.setattr(standing, "unexplained", lambda *_: None)
    problem = SimpleNamespace(predictor=SimpleNamespace(luck=None))
    searched = SelectionResult(problem, None, None, ("motor-lag", "wheelbase", "yaw-bias"), ())
    found = standing.standing_of(searched, None, SNAKE, lambda _: None)
    assert found.selection.accepted == ("motor-lag",)
    assert found.errors.horizons["stretch"].models[1].rms_m == 1  # those of what stands
    assert found.withdrawn == ()


def test_one_number_that_is_certain_is_enough():
    east, north = (FreeParameter("floor-slope", p) for p in SNAKE.catalogue()["floor-slope"].parameters)
    model = SNAKE.with_effect("floor-slope", east_rad=0.02, north_rad=0.001)
    values, jacobian = np.array([0.02, 0.001]), np.zeros((TRIALS, 3, 2))
    for half, least in ((0.005, ""), (0.015, "floor-slope")):
        spans = {0: (0.02 - half, 0.02 + half), 1: (-0.004, 0.006)}
        fit = Fit(model, (east, north), values, np.eye(2), OF_TRIALS, OF_TRIALS, ZEROS, jacobian, spans)
        problem = SimpleNamespace(predictor=SimpleNamespace(luck="luck"))
        steps = (SelectionStep((), 0.0, "", of=TRIED),)
        assert least_certain(SelectionResult(problem, fit, fit, ("floor-slope",), steps)) == least


def test_what_is_not_certain_goes_one_at_a_time_and_the_rest_is_fitted_again(monkeypatch):
    searched = found(joint2=(0.02, 0.015), joint7=(0.095, 0.008), joint10=(0.02, 0.019))
    later = {("joint-zero-joint2", "joint-zero-joint7"): found(joint2=(0.03, 0.01), joint7=(0.095, 0.008))}
    monkeypatch.setattr(SelectionResult, "lacking", lambda self, gone: later[tuple(n for n in self.accepted if n not in gone)])
    monkeypatch.setattr(standing, "refitted", lambda selection, *_: selection)
    monkeypatch.setattr(standing, "errors_before_and_after", lambda *_: changed(True))
    monkeypatch.setattr(standing, "residual_dependence", lambda *_: [])
    monkeypatch.setattr(standing, "unexplained", lambda *_: None)
    stands = standing.standing_of(searched, None, SNAKE, lambda _: None)
    assert stands.selection.accepted == ("joint-zero-joint2", "joint-zero-joint7")
    assert not stands.withdrawn


@pytest.mark.parametrize(("value", "halves"), [(0.1, 2.0), (-0.1, 2.0)])
def test_halves_of_an_interval_to_neutral(value, halves):
    assert standing._intervals_away(found(joint3=(value, 0.05)).fit, 0) == pytest.approx(halves)
