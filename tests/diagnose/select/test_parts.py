"""What stands in the place of an effect that is taken out: what it extends, if that earns a place itself."""

from types import SimpleNamespace

import pytest

from bns.diagnose.select.look_back import LookBack
from bns.physics.effects import all_effects


@pytest.mark.parametrize(
    ("name", "earns", "given", "left"),
    [
        ("uneven-patch", True, False, ("floor-patch",)),
        ("uneven-patch", False, False, ()),
        ("uneven-patch", False, True, ("floor-patch",)),
        ("floor-patch", False, False, ()),
    ],
    ids=["it earns its place", "it earns none", "it was given", "nothing is extended"],
)
def test_what_an_effect_extends_stands_in_its_place_where_it_earns_one(monkeypatch, name, earns, given, left):
    out = []

    def reduced(catalogue, problem, fit, one):
        out.append(one)
        return f"{fit.called if isinstance(fit, SimpleNamespace) else fit} - {one}"

    def may_stay(problem, fit, part):
        assert (fit, part) == ("fit - uneven-patch", "floor-patch")
        return earns

    monkeypatch.setattr("bns.diagnose.select.look_back.reduced", reduced)
    active = SimpleNamespace(effect=SimpleNamespace(name=name), replaces="floor-patch" if given else "")
    fit = SimpleNamespace(called="fit", model=SimpleNamespace(effects=[active]))
    acceptance = SimpleNamespace(may_stay=may_stay)
    look_back = LookBack(None, all_effects(), {}, None, acceptance, None)
    found, parts = look_back._without(None, fit, name)
    assert parts == left
    taken = [name, "floor-patch"] if name == "uneven-patch" and not left else [name]
    assert (out, found) == (taken, " - ".join(["fit", *taken]))
