"""Effects that shift all motion in time, beside free answers to past commands: those that only make up for a term's steps go."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.residuals import pruned as module
from bns.diagnose.residuals.grammar import CHANGES, RESPONSE, RESPONSE_OF, WHEELS


@dataclass(frozen=True)
class Beside:
    """What `without_shifts` asks of a state; the loss of held-out trials is 100 each, of which a gain must be 0.001."""

    names: tuple[str, ...]
    terms: tuple[SimpleNamespace, ...]
    problem: None = None
    fit: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(held_out=np.full(8, 100.0)))

    def without(self, _predictor, name, _lacking):
        return replace(self, names=tuple(one for one in self.names if one != name))


def left(monkeypatch, alone, signal, also=()):
    """The names that stay of those in ``alone``: name -> what it earns without terms, by the names that are still there."""
    monkeypatch.setattr(module, "fit_without", lambda *_: None)
    monkeypatch.setattr(module, "worth_alone", lambda _predictor, _given, state: {n: alone(n, state.names) for n in state.names})
    names = ("motor-lag", "command-delay", "clock-offset", *also)
    return module.without_shifts(None, None, Beside(names, (SimpleNamespace(signal=signal),))).names


def cancelling(name, _names):
    """Beside a lag, a late command and an early clock earn nothing without the term, whether there is one of them or both."""
    return 50.0 if name == "motor-lag" else 0.01


def a_late_clock_with_a_companion(name, names):
    """Each earns little while the other is there; one alone earns much."""
    return 50.0 if name == "motor-lag" or len(names) == 2 else {"clock-offset": 0.05, "command-delay": 0.02}[name]


def test_two_shifts_that_cancel_go_where_they_earn_nothing_without_the_term(monkeypatch):
    assert left(monkeypatch, cancelling, RESPONSE_OF["v"]) == ("motor-lag",)


def test_of_two_shifts_that_stand_for_each_other_one_stays(monkeypatch):
    found = left(monkeypatch, a_late_clock_with_a_companion, RESPONSE_OF["v"])
    assert found == ("motor-lag", "clock-offset")


@pytest.mark.parametrize("signal", [WHEELS, "place"])
def test_beside_terms_that_are_no_answer_to_past_commands_they_stay(monkeypatch, signal):
    assert len(left(monkeypatch, cancelling, signal)) == 3


def test_beside_a_free_response_of_the_wheels_they_go_however_well_they_do(monkeypatch):
    assert left(monkeypatch, lambda *_: 50.0, RESPONSE) == ("motor-lag",)


@pytest.mark.parametrize("axis", ["v", "w"])
def test_headings_that_come_late_are_a_part_of_a_response_of_one_of_both_motions(monkeypatch, axis):
    """Such a response can begin later than the other motion does."""
    kept = left(monkeypatch, lambda *_: 50.0, RESPONSE_OF[axis], ("heading-delay",))
    assert kept == ("motor-lag", "command-delay", "clock-offset")


@pytest.mark.parametrize("signal", [CHANGES, WHEELS])
def test_beside_other_terms_late_headings_stay(monkeypatch, signal):
    assert "heading-delay" in left(monkeypatch, lambda *_: 50.0, signal, ("heading-delay",))
