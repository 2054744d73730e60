"""Thresholds of the diagnosis stand in one place, each with its reason, and a result carries them."""

import ast
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import pytest

import bns
from bns.api.common.provenance import provenance
from bns.diagnose.select import stepwise
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.settings.page import page
from bns.physics.model import load_model

DIAGNOSE = Path(bns.__file__).parent / "diagnose"
DOCS = Path(__file__).resolve().parents[2] / "docs"
NO_SETTINGS = {
    ("residuals/ranked_families.py", "_SMALL"): "step of a difference quotient of a linear term",
    ("data/mapping.py", "UNITS"): "factors between units, by definition",
    ("data/robust.py", "_NORMAL"): "the median of a standard normal number's size",
    ("estimate/fitting.py", "_LATELY"): "the size of a cache: the answers are the same for any",
    ("predict/paired_errors.py", "_LATELY"): "the size of a cache: the answers are the same for any",
    ("parallel.py", "MOST"): "threads: the answers are the same for any number",
    ("predict/wheels.py", "_KEPT"): "the size of a cache: the answers are the same for any",
    ("report/page.py", "_PIXELS_IN_POINT"): "layout",
    ("report/figures.py", "_NARROW_CHARACTERS"): "layout",
    ("report/people.py", "_UNITS"): "factors between units, by definition",
    ("residuals/floor_field.py", "_WIDE_M"): "wider than the floor that tents cover, so that all of them are meant",
    ("predict/stretches.py", "_RIMS"): "where a rim has the friction of the floor within 1 %: saves simulations alone",
    ("residuals/past_in_words.py", "_WAYS"): "a metre, driven lately and before: where a curve is put in words",
    ("residuals/phrases.py", "POINTS"): "points at which a curve is evaluated to be put in words",
}
"""Numbers that stand in a module, and why they decide nothing that could be decided otherwise."""


def numbers_of_module(source: str) -> list[str]:
    """Names that a module assigns, outside of functions and classes, a value with a number written in it."""
    found = []
    for node in ast.parse(source).body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        inside = [one.value for one in ast.walk(node.value) if isinstance(one, ast.Constant)]
        if any(isinstance(value, int | float) and not isinstance(value, bool) for value in inside):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found += [one.id for target in targets for one in ast.walk(target) if isinstance(one, ast.Name)]
    return found


def test_numbers_stand_in_the_settings_alone():
    modules = {str(path.relative_to(DIAGNOSE)): path for path in DIAGNOSE.rglob("*.py")}
    found = {
        (module, name)
        for module, path in modules.items()
        if not module.startswith("settings/")
        for name in numbers_of_module(path.read_text())
    }
    assert found == set(NO_SETTINGS), "a new number belongs in bns/diagnose/settings, with its unit and its reason"


@pytest.mark.parametrize(
    ("source", "names"),
    [
        ("LEAST = 0.05", ["LEAST"]),
        ("LOW, HIGH = -1, 2 * LOW", ["LOW", "HIGH"]),
        ("LEAST: float = 1 / 3", ["LEAST"]),
        ("TABLE = {'s': (1e3, 'ms')}\nGUESS = np.array([2e-3])", ["TABLE", "GUESS"]),
        ("LEAST = DEFAULTS.select.min_gain\nNAME = 'one'\nQUIET = True\ndef f():\n    k = 3", []),
    ],
)
def test_a_number_of_any_form_is_seen(source, names):
    assert numbers_of_module(source) == names


def test_every_setting_has_a_unit_and_a_reason():
    rows = list(DEFAULTS.rows())
    assert len(rows) > 120
    for room, name, value, unit, why in rows:
        assert value is not None
        assert unit, (room, name)
        assert len(why) > 30, (room, name)
        assert why.endswith("."), (room, name)


def test_modules_go_by_the_settings():
    assert stepwise.FALSE_ALARM == DEFAULTS.select.false_alarm == 0.05
    with pytest.raises(FrozenInstanceError):
        DEFAULTS.select.false_alarm = 0.5


def test_another_value_is_another_digest():
    stricter = replace(DEFAULTS, select=replace(DEFAULTS.select, false_alarm=0.01))
    assert stricter.digest() != DEFAULTS.digest() == replace(DEFAULTS).digest()
    assert len(DEFAULTS.digest()) == 12


def test_a_result_says_which_settings_it_was_made_by():
    made = provenance(load_model("khepera"), "0" * 64)
    assert made["settings_digest"] == DEFAULTS.digest()
    assert made["settings"]["select"]["false_alarm"] == 0.05
    assert made["settings"]["estimate"]["noise_guess"] == [2e-3, 8e-3, 4e-3, 2e-3, 2e-2]
    assert sum(len(room) for room in made["settings"].values()) == len(list(DEFAULTS.rows()))


def test_the_page_is_made_from_the_settings():
    assert (DOCS / "settings.md").read_text() == page(), "python -m bns.diagnose.settings > docs/settings.md"
