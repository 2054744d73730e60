"""Effects that extend others: when they are tried, and in whose place."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.select.extending import extended, fits_better, simple, to_extend, variant
from bns.physics.effects import all_effects


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
