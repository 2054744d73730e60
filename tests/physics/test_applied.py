"""What effects that are not the package's return is looked at wherever they act; those of the package pass as they are."""

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numba
import numpy as np
import pytest

import bns
from bns.errors import EffectError, ModelError
from bns.physics.applied import applied
from bns.physics.effect import Effect, Parameter
from bns.physics.effects import all_effects
from bns.physics.formula import formula_effect
from bns.physics.jointed.plant import Sighting, sound
from bns.physics.signals import Body, Flow, Stamps, View, Wheels
from bns.registry import JOINT_EFFECTS

ONES = np.ones((2, 3))
SIGNALS = {
    "wheel": Wheels(ONES, ONES, ONES, 0.1),
    "body": Body(*[ONES] * 7),
    "world": Flow(),
    "clock": Stamps(np.array([0.0, np.nan])),
    "measure": View(np.full((4, 3), np.nan)),
    "mechanics": sound(("hip", "knee"), 3, 1),
    "sight": Sighting(*[np.ones((5, 1, 2))] * 3),
}


def own(stage, apply, **fields):
    return Effect("mine", stage, (Parameter("k", "1", -1, 1, (-0.5, 0.5), 0.0, "x"),), "", "", (), apply, **fields)


def changed(stage, **fields):
    return applied(own(stage, lambda signal, k: replace(signal, **fields)), SIGNALS[stage], {"k": 0.5})


@pytest.mark.parametrize(
    ("stage", "field", "value", "must"),
    [
        ("wheel", "left_m_s", ONES[:, :2], r"array of float64 of the shape \(2, 2\); .* shape \(2, 3\), as before"),
        ("wheel", "left_m_s", 0.1, r"the number 0\.1; .* shape \(2, 3\)"),
        ("wheel", "left_m_s", ONES.tolist(), "an object of the type list; it must be an array"),
        ("wheel", "left_m_s", None, r"nothing \(None\); it must be an array"),
        ("wheel", "left_m_s", ONES.astype(int), "array of int64 of .*; it must be an array of float64"),
        ("wheel", "left_m_s", ONES.astype(complex), "array of complex128"),
        ("wheel", "followed", ONES[0], r"shape \(3,\)"),
        ("wheel", "wheelbase_m", ONES, "it must be a number"),
        ("wheel", "conditions", 3, "it must be a Conditions"),
        ("body", "place", ONES[:1], r"shape \(1, 3\)"),
        ("world", "x_m_s", np.ones(2), "it must be a number"),
        ("world", "x_m_s", True, "it must be a number"),
        ("clock", "t_s", np.zeros(3), r"shape \(3,\).* shape \(2,\)"),
        ("measure", "poses", np.zeros((4, 2)), r"shape \(4, 2\).* shape \(4, 3\)"),
        ("mechanics", "mass", np.ones(2), r"shape \(2,\).* shape \(3,\)"),
        ("mechanics", "slope", (0.1,), "it must be a tuple"),
        ("mechanics", "rough", 1.0, "it must be a tuple"),
        ("sight", "point_m", np.ones((5, 2)), r"shape \(5, 2\).* shape \(5, 1, 2\)"),
    ],
)
def test_a_field_of_another_kind_or_shape_is_refused(stage, field, value, must):
    kind = type(SIGNALS[stage]).__name__
    said = rf"^The effect mine in .*test_applied\.py \(line \d+\): its apply returned a {kind} whose {field} is .*{must}"
    with pytest.raises(EffectError, match=said):
        changed(stage, **{field: value})


@pytest.mark.parametrize(
    ("stage", "field", "value"),
    [
        ("wheel", "left_m_s", ONES * np.nan),
        ("wheel", "followed", ONES * np.inf),
        ("world", "x_m_s", np.inf),
        ("clock", "t_s", np.array([np.nan, np.nan])),
        ("mechanics", "mass", np.array([1.0, 1.0, np.nan])),
    ],
)
def test_what_is_not_finite_any_more_is_refused_as_of_a_formula(stage, field, value):
    with pytest.raises(ModelError, match=rf"\(line \d+\): {field} is not finite .* with \{{'k': 0\.5\}}") as told:
        changed(stage, **{field: value})
    assert type(told.value) is ModelError  # a fit goes on elsewhere, as where a formula has no value


@pytest.mark.parametrize(
    ("stage", "field", "value"),
    [
        ("wheel", "left_m_s", 2 * ONES),
        ("wheel", "followed", ONES),
        ("wheel", "wheelbase_m", np.float64(0.2)),
        ("body", "place", np.ones((2, 3, 3))),
        ("world", "x_m_s", 1),
        ("clock", "t_s", np.array([1.0, np.nan])),
        ("measure", "poses", np.full((4, 3), np.nan)),
        ("mechanics", "speed", np.array([np.inf, 0.5])),
        ("mechanics", "slope", (0.1, 0.0)),
        ("mechanics", "rough", (3,)),
    ],
)
def test_what_is_as_before_passes(stage, field, value):
    np.testing.assert_array_equal(getattr(changed(stage, **{field: value}), field), value)


@pytest.mark.parametrize("stage", SIGNALS)
def test_another_thing_than_the_signal_is_refused(stage):
    kind = type(SIGNALS[stage]).__name__
    for given, said in ((None, r"nothing \(None\)"), (ONES, "an array"), (3.0, r"the number 3\.0"), ("a", "an object")):
        with pytest.raises(EffectError, match=rf"its apply returned {said}.*; it must return the {kind} that it gets"):
            applied(own(stage, lambda _, k, given=given: given), SIGNALS[stage], {"k": 0.5})


@pytest.mark.parametrize("apply", [lambda body: body, lambda body, j: body, lambda: None, partial(lambda body, j: body, j=1)])
def test_other_arguments_are_told_with_those_that_it_gets(apply):
    with pytest.raises(EffectError, match=r"\(line \d+\): its apply cannot be called: .*It must be def apply\(body, k\)"):
        applied(own("body", apply), SIGNALS["body"], {"k": 0.5})


@pytest.mark.parametrize(("fault", "kind"), [(lambda k: 1 / (k - k), ModelError), (lambda k: {}[k], EffectError)])
def test_a_division_by_nothing_may_be_one_at_these_numbers_alone(fault, kind):
    with pytest.raises(ModelError, match=r"^The effect mine in .*test_applied\.py does not run \(line \d+\): \w+Error: ") as told:
        applied(own("body", lambda body, k: body.scaled(fault(k))), SIGNALS["body"], {"k": 0.5})
    assert type(told.value) is kind


def test_an_object_that_is_called_and_one_without_python_are_named_too():
    class Called:
        def __call__(self, body, k):
            return None

    with pytest.raises(EffectError, match=r"^The effect mine in .*test_applied\.py \(line \d+\)"):
        applied(own("body", Called()), SIGNALS["body"], {"k": 0.5})
    with pytest.raises(EffectError, match=r"^The effect mine: its apply cannot be called"):
        applied(own("body", dict), SIGNALS["body"], {"k": 0.5})


def test_errors_that_explain_themselves_pass():
    with pytest.raises(ModelError, match=r"^The column of the log 'current_a' is asked for"):
        applied(own("body", lambda body, k: body.scaled(body.logged["current_a"])), SIGNALS["body"], {"k": 0.5})


def test_effects_of_the_package_are_not_looked_at():
    joints = [JOINT_EFFECTS.load(name) for name in JOINT_EFFECTS.names()]
    of_joints = [part if isinstance(part, Effect) else part.effect for part in joints]
    shipped = [*all_effects().values(), *of_joints, formula_effect("drag", "k * v", "v")]
    assert not any(effect.is_own for effect in shipped)
    assert replace(shipped[0], apply=lambda wheels, **_: wheels).is_own


def test_no_effect_acts_without_being_looked_at():
    root = Path(bns.__file__).parent
    acting = [path for path in root.rglob("*.py") if re.search(r"effect\.apply\(", path.read_text(encoding="utf-8"))]
    assert [path.name for path in acting] == ["applied.py"]


def _scaled_in_place(wheels, k):
    wheels.left_m_s[:] *= k
    return wheels


def _scaled_into(wheels, k):
    np.multiply(wheels.left_m_s, k, out=wheels.left_m_s)
    return wheels


@numba.njit
def _written(array, k):
    array[0, 0] = k


def _scaled_by_numba(wheels, k):
    _written(wheels.left_m_s, k)
    return wheels


@pytest.mark.parametrize("apply", [_scaled_in_place, _scaled_into, _scaled_by_numba])
def test_an_effect_that_writes_into_what_it_gets_is_refused(apply):
    wheels = Wheels(np.ones((2, 3)), np.ones((2, 3)), ONES, 0.1)
    with pytest.raises(EffectError, match=r"mine .*line \d+.*writes into the arrays of the Wheels.*dataclasses\.replace"):
        applied(own("wheel", apply), wheels, {"k": 0.5})
    assert (wheels.left_m_s == 1).all()
    wheels.left_m_s[0, 0] = 2  # what comes after may write again


def test_a_view_of_what_it_gets_may_be_written_by_what_comes_after():
    wheels = Wheels(np.ones((2, 3)), np.ones((2, 3)), ONES, 0.1)
    given = applied(own("wheel", lambda w, k: replace(w, left_m_s=w.right_m_s[:, ::-1])), wheels, {"k": 0.5})
    assert given.left_m_s.flags.writeable
    given.left_m_s[0, 0] = 7
    assert (wheels.right_m_s == 1).all()


def test_arrays_can_be_written_by_others_while_an_effect_acts():
    """Other threads work on them; what comes back untouched is the same array, also one that could not be written before."""
    wheels = Wheels(np.ones((2, 3)), np.ones((2, 3)), np.ones((2, 3)), 0.1)
    wheels.right_m_s.flags.writeable = False

    def apply(given, k):
        wheels.left_m_s[0, 0] = 3.0
        with pytest.raises(ValueError, match="read-only"):
            given.left_m_s[0, 0] = 4.0
        return replace(given, step_s=given.step_s * 2.0)

    found = applied(own("wheel", apply), wheels, {"k": 0.5})
    assert found.left_m_s is wheels.left_m_s
    assert found.right_m_s is wheels.right_m_s
    assert (found.step_s == 2.0).all()
