"""An effect and a free term that cancel in part: a note says so, and the sentence takes no side."""

from copy import deepcopy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.caveats import notes_on
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.cancelling import Cancelled, cancelled
from bns.diagnose.report.sized import sized_sentence
from bns.diagnose.report.text import _number
from bns.diagnose.residuals.grammar import RESPONSE
from bns.diagnose.residuals.unexplained import NOTHING
from bns.physics.effects import effect_named
from tests.diagnose.worlds import NOMINAL, measured


def number_of(name, key):
    return next(p for p in effect_named(name).parameters if p.name == key)


def fit_of(*numbers):
    """As a `Fit`: name of the effect, parameter, value, low, high each."""
    free = tuple(SimpleNamespace(effect=name, parameter=number_of(name, key)) for name, key, *_ in numbers)
    return SimpleNamespace(
        free=free, values=[number[2] for number in numbers], interval=lambda index: tuple(numbers[index][3:]), model=NOMINAL
    )


SAG, GAIN = ("battery-sag", "rate_per_s"), ("speed-gain", "gain")


@pytest.mark.parametrize(
    ("without", "beside", "cancels"),
    [
        ((*SAG, 1e-4, 0.8e-4, 1.2e-4), (*SAG, 3e-4, 2.5e-4, 3.5e-4), True),  # 2.5 is more than twice 1.2
        ((*SAG, 1e-4, 0.8e-4, 1.2e-4), (*SAG, 3e-4, 2.3e-4, 3.7e-4), False),  # 2.3 is not
        ((*SAG, 1e-4, 0.8e-4, 1.2e-4), (*SAG, -3e-4, -3.5e-4, -2.5e-4), True),
        ((*SAG, -1e-4, -1.2e-4, -0.8e-4), (*SAG, 1e-4, 0.8e-4, 1.2e-4), True),  # no larger, to the other side
        ((*SAG, -1e-4, -1.2e-4, -0.8e-4), (*SAG, 1e-5, -1e-5, 3e-5), False),  # perhaps none
        ((*SAG, -1e-5, -3e-5, 1e-5), (*SAG, 2e-5, 1e-5, 3e-5), False),  # perhaps none before
        ((*SAG, 1e-4, 0.8e-4, 1.2e-4), (*SAG, 2e-4, -3e-4, 7e-4), False),
        ((*GAIN, 1.05, 1.04, 1.06), (*GAIN, 1.14, 1.13, 1.15), True),  # neutral is 1: 5 % and 14 %
        ((*GAIN, 1.05, 1.04, 1.06), (*GAIN, 1.11, 1.1, 1.12), False),
        ((*GAIN, 1.05, 1.04, 1.06), (*GAIN, 0.97, 0.96, 0.98), True),
    ],
)
def test_a_number_that_a_term_multiplies_or_turns_round_cancels_a_part_of_it(without, beside, cancels):
    name, key, value, *_ = beside
    found = list(cancelled(fit_of(without), fit_of(beside), (name,)))
    assert found == ([Cancelled(name, number_of(name, key), without[2], value)] if cancels else [])
    assert not list(cancelled(fit_of(without), fit_of(beside), ()))


LAG = ("motor-lag", "tau_s")


@pytest.mark.parametrize(
    ("beside", "past", "divided"),
    [
        ((0.024, 0.02, 0.028), True, True),
        ((0.024, 0.02, 0.028), False, False),  # a curve of the speed contains no lag
        ((0.045, 0.04, 0.05), True, True),  # 0.05 is less than half of 0.11
        ((0.05, 0.045, 0.056), True, False),
        ((0.0, -0.01, 0.01), True, True),
    ],
)
def test_a_lag_of_which_a_free_response_takes_the_most_is_not_to_be_read_by_itself(beside, past, divided):
    fits = fit_of((*LAG, 0.12, 0.11, 0.13)), fit_of((*LAG, *beside))
    found = list(cancelled(*fits, ("motor-lag",), past))
    assert found == ([Cancelled("motor-lag", number_of(*LAG), 0.12, beside[0], True)] if divided else [])
    perhaps_none = fit_of((*LAG, 0.12, -0.1, 0.3))
    assert not list(cancelled(perhaps_none, fits[1], ("motor-lag",), past))
    for one in found:
        said = one.in_words
        assert said.startswith("motor-lag and the free term each describe a part of the same delay: with the term")
        assert said.endswith("and 0.12 without it. Only both together are determined: do not read tau_s by itself.")


def test_a_lag_that_differs_in_turns_has_one_size():
    without, beside = (
        (("inertia-lag", "tau_s", tau, 0.9 * tau, 1.1 * tau), ("inertia-lag", "turn_ratio", ratio, 0.9 * ratio, 1.1 * ratio))
        for tau, ratio in ((0.25, 1.0), (1.24, 0.2))
    )
    (found,) = cancelled(fit_of(*without), fit_of(*beside), ("inertia-lag",))
    assert found == Cancelled("inertia-lag", number_of("inertia-lag", "tau_s"), 0.25, 1.24)


def test_of_an_effect_with_several_numbers_none_is_said_to_have_outgrown_the_others():
    without, beside = (
        (("floor-slope", "x_m_s", x, x, x), ("floor-slope", "y_m_s", 0.01, 0.01, 0.01)) for x in (0.001, 0.1)
    )
    assert not list(cancelled(fit_of(*without), fit_of(*beside), ("floor-slope",)))


def test_the_note_has_both_numbers():
    said = Cancelled("understeer", number_of("understeer", "loss_s_m"), 0.201, -0.051).in_words
    assert said.startswith("understeer and the free term cancel in part: with the term in the model, loss_s_m is -0.051 s/m")


@pytest.mark.parametrize(
    ("rose", "signal", "beside", "said"),
    [
        ((), "time", 3e-4, "battery-sag and the free term cancel in part"),
        (("trial",), "time", 3e-4, ""),
        ((), "time", 3e-5, ""),
        ((), RESPONSE, 3e-5, "battery-sag and the free term each describe a part"),
    ],
)
def test_it_is_among_the_notes_where_the_term_is_in_the_extended_model(monkeypatch, rose, signal, beside, said):
    monkeypatch.setattr("bns.diagnose.caveats._on_undescribed", lambda found: ["on what is left"])
    monkeypatch.setattr("bns.diagnose.caveats.single_wheel", lambda fit: [f"one wheel by {fit.values[0]}"])
    selection = SimpleNamespace(
        implausible_in=lambda _: {}, accepted=("battery-sag",), competing_models=(), steps=(SimpleNamespace(ranking=()),),
        fit=fit_of((*SAG, 1e-4, 0.8e-4, 1.2e-4)), nominal=SimpleNamespace(losses=np.ones(10)),
    )  # fmt: skip
    nothing = dict.fromkeys(("withdrawn", "unseen", "formula"))
    found = SimpleNamespace(
        **nothing, selection=selection, negligible={}, beside_negligible={}, kept_for={}, seen_in_heading={}, rest=NOTHING,
        imitating=("battery-sag",), slight_along=(),
        terms=(SimpleNamespace(fit=fit_of((*SAG, beside, 0.9 * beside, 1.1 * beside)), signal=signal),),
        errors_with_terms=SimpleNamespace(rose_in_the_end=rose, falls_in_the_end=not rose),
    )  # fmt: skip
    every = list(notes_on(found, tracks_of(measured(NOMINAL, trials=10)), None))
    assert "on what is left" in every
    assert f"one wheel by {1e-4 if rose else beside}" in every  # by the numbers that are shown
    notes = [note for note in every if "the free term" in note]
    assert [note.startswith(said) for note in notes] == ([True] if said else [])


def test_the_sentence_takes_no_side_then(monkeypatch):
    """Slip that grows with the speed, and understeer: with a term that slows both motions the number changes its sign."""
    without = fit_of(("understeer", "loss_s_m", 0.2, 0.19, 0.21))
    beside = fit_of(("understeer", "loss_s_m", -0.05, -0.06, -0.04))

    def numbers_of(fit):
        return {"understeer": {"loss_s_m": {"value": fit.values[0], "low": None, "high": None}}}

    monkeypatch.setattr("bns.diagnose.diagnosis.numbers_of", numbers_of)
    selection = SimpleNamespace(fit=without, accepted=("understeer",))
    found = Diagnosis("unlisted", selection, terms=(SimpleNamespace(fit=beside, name="unlisted", signal="speed"),))
    number = found.numbers["understeer"]
    assert number["loss_s_m"]["cancels"]
    understeer = effect_named("understeer")
    assert sized_sentence(understeer, number) == understeer.sentence
    alone = Diagnosis("effects", selection)
    assert "less the faster" in sized_sentence(understeer, alone.numbers["understeer"])


def test_nor_does_it_give_a_lag_of_which_a_free_response_has_the_most(monkeypatch):
    monkeypatch.setattr("bns.diagnose.diagnosis.numbers_of", lambda fit: {"motor-lag": {"tau_s": {"value": fit.values[0]}}})
    selection = SimpleNamespace(fit=fit_of((*LAG, 0.12, 0.11, 0.13)), accepted=("motor-lag",))
    for signal, cancels in ((RESPONSE, True), ("speed", False)):
        term = SimpleNamespace(fit=fit_of((*LAG, 0.02, 0.01, 0.03)), name="unlisted", signal=signal)
        number = Diagnosis("unlisted", selection, terms=(term,)).numbers["motor-lag"]["tau_s"]
        assert ("cancels" in number) is cancels
        said = _number("tau_s", number | {"unit": "s", "low": 0.01, "high": 0.03})
        assert said == f"tau_s = 0.02 s (95 %: 0.01 to 0.03{', together with the free term only: see the notes' * cancels})"


def test_nor_does_it_give_the_mean_of_delays_that_differ(monkeypatch):
    """A controller that reads its commands every 0.12 s: half of that is no lag of the motors."""
    values = {"motor-lag": {"tau_s": {"value": 0.06}}, "wheelbase": {"factor": {"value": 1.02}}}
    monkeypatch.setattr("bns.diagnose.diagnosis.numbers_of", lambda _: deepcopy(values))
    selection = SimpleNamespace(fit=fit_of((*LAG, 0.06, 0.05, 0.07)), accepted=("motor-lag", "wheelbase"))
    scattered = replace(NOTHING, command_times=SimpleNamespace())
    numbers = Diagnosis("unlisted", selection, rest=scattered).numbers
    assert numbers["motor-lag"]["tau_s"]["of_mean"]
    assert "of_mean" not in numbers["wheelbase"]["factor"]
    assert "of_mean" not in Diagnosis("effects", selection).numbers["motor-lag"]["tau_s"]
    said = _number("tau_s", numbers["motor-lag"]["tau_s"] | {"unit": "s", "low": 0.05, "high": 0.07})
    assert said == "tau_s = 0.06 s (95 %: 0.05 to 0.07, perhaps only the mean of delays that differ: see the notes)"
    assert sized_sentence(effect_named("motor-lag"), numbers["motor-lag"]) == effect_named("motor-lag").sentence
