"""An accepted effect that could act at another place in the chain comes with what speaks for the place that was chosen."""

from types import SimpleNamespace

import pytest

from bns.diagnose import effect_caveats
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.select import variants
from bns.diagnose.select.result import SelectionResult
from bns.diagnose.select.variants import uncertain_variants
from bns.physics.effects import all_effects
from tests.diagnose.worlds import NOMINAL, hidden, measured

DEAD_ZONE, LIMIT = {"dead_zone": {"width_m_s": 0.005}}, {"speed_limit": {"max_m_s": 0.12}}
COMMANDS, DIAMETERS = {"wheel_mismatch": {"ratio": 0.975}}, {"wheel_diameters": {"ratio": 0.975}}


def found_in(seed=2, **effects):
    true = hidden(**effects).arranged()
    predictor = WheelPredictor(tracks_of(measured(true, trials=20, seed=seed)))
    problem = problem_for(predictor, true)
    names = tuple(name.replace("_", "-") for name in effects)
    return SelectionResult(problem, problem.fit(NOMINAL), problem.fit(true), names, (), ())


@pytest.mark.parametrize(
    "effects", [COMMANDS, LIMIT | COMMANDS, LIMIT | DIAMETERS, DEAD_ZONE, DEAD_ZONE | COMMANDS | DIAMETERS]
)
def test_a_place_that_is_certain_or_makes_no_difference_is_not_spoken_of(effects):
    assert uncertain_variants(found_in(**effects)) == []


def test_commands_or_diameters_beside_a_dead_zone_that_cannot_tell():
    (one,) = uncertain_variants(found_in(**DEAD_ZONE, **COMMANDS))
    assert (one.name, one.other) == ("wheel-mismatch", "wheel-diameters")
    assert 0.5 < one.evidence < 3.0
    assert one.in_words == (
        "wheel-diameters has the same parameters as wheel-mismatch and acts at another place in the chain. Held-out trials do "
        "not tell them apart. To decide: measure both wheels' circumferences."
    )


def test_evidence_is_told_as_odds(monkeypatch):
    monkeypatch.setattr(variants, "EVIDENCE", 0.5)
    monkeypatch.setattr(variants, "CERTAIN", 1e4)
    (one,) = uncertain_variants(found_in(**DEAD_ZONE, **COMMANDS))
    assert "Held-out trials are 5 times as likely with wheel-mismatch, which is evidence, not proof." in one.in_words
    (other,) = uncertain_variants(found_in(**LIMIT, **DIAMETERS))
    assert (other.name, other.other) == ("wheel-diameters", "wheel-mismatch")
    assert other.evidence > 1000


def test_a_diagnosis_says_so():
    true = hidden(**DEAD_ZONE, **COMMANDS).arranged()
    predictor = WheelPredictor(tracks_of(measured(true, trials=20, seed=2)))
    others = set(all_effects()) - {"dead-zone", "wheel-mismatch", "wheel-diameters"}
    found = diagnose(predictor, NOMINAL, barred=others)
    assert sorted(found.effects) == ["dead-zone", "wheel-mismatch"]
    assert any("wheel-diameters has the same parameters as wheel-mismatch" in note for note in found.notes)


@pytest.mark.parametrize(("terms", "said"), [((), 1), (("unlisted",), 0)])
def test_with_terms_which_change_the_numbers_it_is_not_said(monkeypatch, terms, said):
    asked = []
    monkeypatch.setattr(effect_caveats, "uncertain_variants", lambda selection: asked.append(selection) or [])
    monkeypatch.setattr(effect_caveats, "order_of_friction", lambda selection: "")
    assert list(effect_caveats.on_place(SimpleNamespace(selection=None, terms=terms))) == []
    assert len(asked) == said
