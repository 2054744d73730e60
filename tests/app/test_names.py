"""Widgets are made without a warning of Panel, old or new, and say what is written on them."""

import ast
import importlib
import warnings
from pathlib import Path

import pytest

import bns

pn = pytest.importorskip("panel", reason="the extra app (Panel) is not installed")
names = importlib.import_module("bns.app.names")

OLD = {"name", "button_type", "button_style"}
"""Arguments of widgets that Panel 1.9 warns of."""


def test_what_is_written_on_a_widget_is_changed_and_read_without_a_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = pn.widgets.Button(**names.called("Open"), **names.looking("primary", "outline"))
        names.call(made, "Close")
    assert names.text_on(made) == "Close" == made.name
    assert (made.button_type, made.button_style) == ("primary", "outline")


def test_no_widget_is_made_under_the_old_names():
    found = [
        f"{path.name}:{call.lineno}"
        for path in (Path(bns.__file__).parent / "app").rglob("*.py")
        for call in ast.walk(ast.parse(path.read_text()))
        if isinstance(call, ast.Call) and ast.unparse(call.func).startswith("pn.widgets.")
        if OLD & {argument.arg for argument in call.keywords}
    ]
    assert found == []
