"""Effects that extend others: when they are tried, and in whose place."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.select.extending import extended, fits_better, moved_in_chain, simple, to_extend, variant
from bns.diagnose.select.stepwise import StepwiseSelection
from bns.physics.effects import all_effects
from tests.diagnose.worlds import NOMINAL, hidden, measured


def test_a_variant_is_taken_for_what_it_earns_on_trials_held_out():
    before = SimpleNamespace(held_out=np.full(10, 2.0), losses=np.full(10, 1.0))
    after = SimpleNamespace(held_out=np.full(10, 1.6), losses=np.full(10, 0.9))
    assert fits_better(before, after)
    assert not fits_better(after, before)
    assert not fits_better(before, SimpleNamespace(held_out=np.full(10, 1.8), losses=np.zeros(10)))


def test_an_effect_begins_where_that_one_fits_best_in_whose_place_it_may_come():
    """Two accepted effects could be exchanged for a lag; what extends a lag begins from the better of these fits."""
    catalogue = all_effects()
    fit = SimpleNamespace(model=SimpleNamespace(effects=()))
    tried = {name: SimpleNamespace(loss=loss) for name, loss in (("wheelbase", 3.0), ("clock-offset", 2.0))}
    exchanges = [(name, "motor-lag", one) for name, one in tried.items()]
    exchanges.append(("wheelbase", "dead-zone", SimpleNamespace(loss=1.0)))
    longer = [catalogue["braking-lag"], catalogue["braking-limit"]]
    found = to_extend(longer, fit, ("wheelbase", "clock-offset"), lambda: exchanges)
    assert found == {"braking-lag": ("clock-offset", tried["clock-offset"])}
    given = SimpleNamespace(model=SimpleNamespace(effects=(SimpleNamespace(effect=catalogue["motor-lag"]),)))
    assert to_extend(longer[:1], given, (), lambda: []) == {"braking-lag": ("motor-lag", given)}


def test_what_is_a_part_of_an_accepted_effect_is_not_tried_beside_it():
    catalogue = all_effects()
    some = [catalogue[name] for name in ("motor-lag", "braking-lag", "wheelbase", "dead-zone")]
    assert [e.name for e in simple(catalogue, some, ("braking-lag", "wheelbase"))] == ["dead-zone"]
    assert extended(catalogue, "braking-lag") == ("motor-lag",)
    assert extended({"braking-lag": catalogue["braking-lag"]}, "braking-lag") == ()
    assert not variant(catalogue, "braking-lag")
    assert not variant(catalogue, "motor-lag")
    assert variant(catalogue, "wheel-diameters")


def test_what_extends_the_same_effect_in_another_way_may_take_the_place_of_one_that_does():
    """For that no exchange is asked for: each of them is a fit."""
    catalogue = all_effects()
    fit = SimpleNamespace(model=SimpleNamespace(effects=(SimpleNamespace(effect=catalogue["braking-lag"]),)))
    others = [catalogue[name] for name in ("lag-mismatch", "braking-lag", "inertia-lag")]
    found = to_extend(others, fit, ("braking-lag",), lambda: pytest.fail("asked for"))
    assert found == {"lag-mismatch": ("braking-lag", fit), "inertia-lag": ("braking-lag", fit)}


def test_exchanges_are_asked_for_only_where_something_has_no_place_yet():
    catalogue = all_effects()
    fit = SimpleNamespace(model=SimpleNamespace(effects=(SimpleNamespace(effect=catalogue["motor-lag"]),)))
    found = to_extend([catalogue["lag-mismatch"]], fit, ("motor-lag",), lambda: pytest.fail("asked for"))
    assert found == {"lag-mismatch": ("motor-lag", fit)}


SLIPS = {"max_m_s2": 0.12, "turn_ratio": 1.5}


def test_a_limit_lies_behind_a_lag_that_shows_only_there():
    """Ramps that last longer than the lag: beside a limit of the motors' force the lag earns nothing."""
    table = measured(hidden(motor_lag={"tau_s": 0.15}, traction_limit=SLIPS), trials=16, seed=11)
    predictor = WheelPredictor(tracks_of(table))
    relevant = {"acceleration-limit", "force-limit", "traction-limit", "motor-lag", "braking-lag"}
    search = StepwiseSelection(predictor, NOMINAL, barred=tuple(set(all_effects()) - relevant))
    found = search.run()
    assert set(found.accepted) == {"traction-limit", "motor-lag"}
    assert found.fit.model.values_of("traction-limit") == pytest.approx(SLIPS, rel=0.03)
    assert found.fit.model.values_of("motor-lag")["tau_s"] == pytest.approx(0.15, rel=0.1)


def test_a_place_in_the_chain_makes_no_difference_until_something_acts_between():
    limited = hidden(force_limit=SLIPS)
    predictor = WheelPredictor(tracks_of(measured(limited, trials=6, seed=3)))
    problem = problem_for(predictor, limited)
    fit = problem.fit(limited)
    (moved,) = moved_in_chain(all_effects(), problem, fit, ("force-limit",))
    assert moved.fit.model.values_of("traction-limit") == fit.model.values_of("force-limit")
    parting = {name for name, effect in all_effects().items() if moved.parted_by(effect)}
    assert {"motor-lag", "command-delay", "gear-friction"} <= parting
    assert not parting & {"speed-gain", "acceleration-limit", "wheelbase", "clock-offset"}
    lagging = limited.with_effect("motor-lag", tau_s=0.2)
    assert moved_in_chain(all_effects(), problem, problem.fit(lagging, rounds=0), ("force-limit",)) == []
