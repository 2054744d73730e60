"""What makes fitted numbers unbelievable, and which measured ones a fit contradicts."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.estimate.plausibility import (
    believable,
    does_no_more,
    fitted_again,
    implausible,
    limiting,
    undetermined,
)
from bns.physics.effect import Parameter
from tests.diagnose.worlds import NOMINAL

GAIN = Parameter("gain", "1", 0.1, 9.0, (0.5, 2.0), 1.0, "")


def fit_of(value, low, high, model=None, effect="e", parameter=GAIN):
    free = (FreeParameter(effect, parameter),)
    return SimpleNamespace(free=free, values=[value], interval=lambda _: (low, high), model=model)


@pytest.mark.parametrize(
    ("value", "low", "high", "believed"),
    [
        (0.4, 0.3, 0.49, False),
        (0.4, 0.3, 0.5, True),
        (3.0, 2.0, 4.0, True),
        (3.0, 2.01, 4.0, False),
        (1.0, 0.2, 5.0, True),
        (3.0, 2.01, float("inf"), True),
    ],
)
def test_a_number_is_implausible_only_where_all_of_its_interval_is(value, low, high, believed):
    why = f"gain = {value:g} is outside of the plausible range, 0.5 to 2"
    assert implausible(fit_of(value, low, high), "e") == ("" if believed else why)


def test_a_number_at_its_bound_is_implausible_where_bounds_count():
    fit = fit_of(9.0, -float("inf"), float("inf"))
    assert implausible(fit, "e") == "gain is at its bound, 9"
    assert implausible(fit, "e", bounds=False) == ""
    assert implausible(fit, "another") == ""


def test_an_effect_with_a_number_at_a_bound_where_it_is_neutral_does_no_more_than_what_it_extends():
    width = Parameter("width", "m/s", 0.0, 1.0, (0.0, 0.1), 0.0, "")

    def no_more(value, extends="lag", parameter=width, asked="e"):
        model = SimpleNamespace(effects=[SimpleNamespace(effect=SimpleNamespace(name="e", extends=extends))])
        return does_no_more(fit_of(value, 0.0, 0.1, model, parameter=parameter), asked)

    assert no_more(0.0)
    assert not no_more(0.0, asked="another")
    assert not no_more(0.0, extends="")  # alone it would do nothing there, and lower no error
    assert not no_more(1.0)  # at its other bound it does something
    assert not no_more(1.0, parameter=GAIN)  # neutral, and at no bound
    assert not no_more(0.0, parameter=replace(width, reached=(0.0,)))


@pytest.mark.parametrize(
    ("cool_s", "held_at"), [(4000.0, 3000.0), (2.0, 3.0), (2999.0, None), (3000.0, None), (3.0, None), (1e5, None)]
)
def test_a_number_outside_of_what_is_plausible_is_held_at_the_end_of_it_unless_it_is_at_its_bound(cool_s, held_at):
    model = NOMINAL.with_effect("heating", loss_per_m=0.01, cool_s=cool_s)
    numbers = model.effects[-1].effect.parameters
    free = (FreeParameter("other", GAIN), *(FreeParameter("heating", p) for p in numbers))
    fit = SimpleNamespace(free=free, values=[3.0, 0.01, cool_s], model=model)
    held = believable(fit, "heating")
    if held_at is None:
        assert held is None
        return
    loss, cool = held.effects[-1].effect.parameters
    assert held.values_of("heating") == {"loss_per_m": 0.01, "cool_s": held_at}
    assert ((loss.low, loss.high), (cool.low, cool.high)) == ((0.0, 2.0), (3.0, 3000.0))


@pytest.mark.parametrize(("low", "high", "said"), [(0.9, 1.1, True), (0.9, 1.3, False), (1.2, 1.3, False), (1.21, 1.3, True)])
def test_a_measured_number_is_contradicted_by_an_interval_that_it_lies_outside_of(low, high, said):
    given = NOMINAL.with_effect("speed-gain", "measured", "bench", gain=1.2)
    now = NOMINAL.with_effect("speed-gain", gain=1.0)
    parameter = replace(now.effects[-1].effect.parameters[0])
    fit = fit_of(1.0, low, high, now, "speed-gain", parameter)
    assert len(list(fitted_again(given, fit))) == 1
    assert bool(list(fitted_again(given, fit, contradicted=True))) is said


@pytest.mark.parametrize(
    ("intervals", "said", "may_be_anything"),
    [
        ([(0.1, 9.0), (0.1, 9.0)], "these data do not determine gain and lag", True),
        ([(0.1, 9.0), (0.1, 8.9)], "", True),
        ([(0.2, 9.0), (0.1, 8.9)], "", False),
        ([], "", False),
    ],
)
def test_an_effect_is_undetermined_where_all_its_numbers_may_be_anything_and_limiting_where_one_may(
    intervals, said, may_be_anything
):
    names = (GAIN, replace(GAIN, name="lag"))
    free = tuple(FreeParameter("e", p) for p, _ in zip(names, intervals, strict=False))
    other = FreeParameter("other", GAIN)
    fit = SimpleNamespace(
        free=(*free, other), values=[1.0] * 3, interval=lambda i: [*intervals, (0.1, 9.0)][i], se=lambda _: 0.1
    )
    assert undetermined(fit, "e") == said
    assert limiting(fit, "e") is may_be_anything


@pytest.mark.parametrize(
    ("kind", "value", "said"),
    [
        ({"floor_share": 10.0, "floor_axis": "x"}, 8.9, True),
        ({"floor_share": 10.0, "floor_axis": "x"}, 8.0, False),
        ({"floor_share": 10.0, "floor_axis": "x"}, 0.2, True),  # as far to the other side
        ({"floor_share": 0.3}, 0.2, False),  # a length that is short has an end
        ({"trial_share": 1.0}, 9.0, True),
        ({"floor_axis": "x"}, 9.0, False),
        ({}, 9.0, False),
    ],
)
def test_a_number_to_which_only_the_log_sets_an_end_is_limiting_as_near_as_a_fit_comes_to_it(kind, value, said):
    p = replace(GAIN, low=0.1, high=9.0, **kind)
    free, interval = (FreeParameter("e", p),), (value - 0.01, value)
    fit = SimpleNamespace(free=free, values=[value], interval=lambda _: interval, se=lambda _: 1.0)
    assert limiting(fit, "e") is said


def test_a_number_without_bounds_is_never_said_to_be_anything():
    unbounded = replace(GAIN, low=-float("inf"), high=float("inf"))
    assert not limiting(fit_of(1.0, -float("inf"), float("inf"), parameter=unbounded), "e")
