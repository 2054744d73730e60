"""An effect of the user's own that asks for what is not there, or fails: named with its file, not shown as a traceback."""

import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

import bns
from bns.cli.main import main
from bns.diagnose.report.sized import sized_sentence
from bns.errors import EffectError, ModelError
from bns.examples import FOLDER
from bns.physics.effects import effect_in_file
from bns.physics.signals import Body, Flow, Stamps, View, Wheels
from tests.diagnose.worlds import NOMINAL, measured

SIGNALS = (Wheels, Body, Flow, Stamps, View)

TEXT = """
from dataclasses import replace
import numpy as np
import bns


def apply(body, share):
    {body}


EFFECT = bns.Effect("nap", "body", (bns.Parameter("share", "1", -0.5, 0.5, (-0.3, 0.3), 0.0, "of the speed"),),
    "v' = v (1 + share cos 2 theta)", "speed varies twice a turn", (), apply, needs_place={place})
"""
FAULTS = [
    ("return body.scaled(body.heading_rad)", r"unknown field of Body 'heading_rad'.* Valid: .*yaw_rad_s.*place\[\.\.\., 2\]"),
    ("return body.scaled(1 + share * np.kos(3))", r"does not run \(line 8\): AttributeError: .*kos"),
    ("return replace(body, speed=1)", r"does not run \(line 8\): TypeError: .*speed"),
    ("return 1 / 0", r"does not run \(line 8\): ZeroDivisionError"),
    ("body.scaled(1 + share)", r"\(line 7\): its apply returned nothing \(None\); .* the Body .* Is a return missing\?"),
    ("return body.yaw_rad_s", r"\(line 7\): its apply returned an array of float64 of the shape .*; it must return the Body"),
    ("return replace(body, yaw_rad_s=body.yaw_rad_s[:3])", r"whose yaw_rad_s is an array of float64 of the shape \(3, "),
    ("return replace(body, yaw_rad_s=share)", r"whose yaw_rad_s is the number .* np\.full_like\(array, number\)"),
    ("return body.scaled(np.nan * share)", r"forward_m_s is not finite \(nan or inf\) somewhere .*'share': "),
]  # fmt: skip


def written(folder, body, place=False):
    path = folder / "nap.py"
    path.write_text(TEXT.format(body=body, place=place))
    return path


@pytest.fixture(scope="module")
def log():
    return measured(NOMINAL, trials=8, commands=3)


@pytest.mark.parametrize(("body", "said"), FAULTS)
def test_a_fault_in_a_file_names_file_effect_and_what_is_wrong(log, tmp_path, body, said):
    path = written(tmp_path, body)
    with pytest.raises(ModelError, match=f"^The effect nap in {re.escape(str(path))} .*{said}"):
        bns.add(log, path, NOMINAL)


@pytest.mark.parametrize("fine", ["abs(share) < 0.05", "not -0.002 < share < 0"])
def test_a_mistake_at_some_values_alone_is_told_wherever_a_fit_comes_upon_it(log, tmp_path, fine):
    """Neither at a start nor at a step is it taken for a value that does not fit."""
    with pytest.raises(EffectError, match="its apply returned nothing"):
        bns.add(log, written(tmp_path, f"return body.scaled(1 + share) if {fine} else None"), NOMINAL)


def test_where_its_numbers_are_not_finite_a_fit_goes_on_elsewhere(log, tmp_path):
    path = written(tmp_path, "return body.scaled(np.full_like(body.moving, 1 + share if abs(share) < 0.05 else np.nan))")
    assert abs(bns.add(log, path, NOMINAL).model.effects[0].by_name["share"]) < 0.05


def test_a_fault_of_an_effect_in_memory_is_named_too(log):
    def apply(wheels, share):
        return wheels.turning(wheels.left, wheels.right_m_s * share)

    one = bns.Effect("mine", "wheel", (bns.Parameter("share", "1", 0.5, 2, (0.5, 2), 1.0, "x"),), "", "", (), apply)
    with pytest.raises(ModelError, match=r"^The effect mine in .*test_own_effects\.py \(line \d+\): unknown field of Wheels"):
        bns.add(log, one, NOMINAL)


def effect(**fields):
    share = bns.Parameter("share", "1", 0.5, 2, (0.5, 2), 1.0, "x")
    return bns.Effect("mine", "wheel", **{"parameters": (share,), "equation": "", "residuals": "", "lookalikes": (), **fields})


def test_an_effect_that_was_made_of_another_has_its_own_name_and_line(log, tmp_path):
    def other(body, share):
        return body.speed

    path = written(tmp_path, "return body.scaled(1 + share)")
    one = replace(effect_in_file(path), name="second", apply=other)
    with pytest.raises(EffectError, match=rf"^The effect second in .*test_own_effects\.py \(line {line_of(other) + 1}\): "):
        bns.add(log, one, NOMINAL)


def line_of(function):
    return function.__code__.co_firstlineno


@pytest.mark.parametrize(
    ("from_wheels", "said"),
    [
        (lambda wheels: wheels.step_s / "a", r" does not run \(line \d+\): \w+: "),
        (lambda _: [(1.0, 2.0)], r" \(line \d+\): its starts_from returned \[\(1\.0, 2\.0\)\]; .* one number for share"),
        (lambda _: 1.5, r".*: its starts_from returned 1\.5; "),
    ],
)
def test_starts_that_fail_are_named(log, from_wheels, said):
    one = effect(apply=lambda wheels, share: wheels.turning(wheels.left_m_s * share, wheels.right_m_s), starts_from=from_wheels)
    with pytest.raises(EffectError, match=r"^The effect mine in .*test_own_effects\.py" + said):
        bns.add(log, one, NOMINAL)


def test_a_sentence_that_fails_is_named():
    for say, said in ((lambda _: 1 / 0, "ZeroDivisionError"), (lambda _: None, r"its sized_by returned nothing \(None\)")):
        with pytest.raises(EffectError, match=r"^The effect mine in .*test_own_effects\.py.*" + said):
            sized_sentence(effect(apply=say, sized_by=say), {"share": {"value": 1.2}})


def test_faults_of_others_stay_what_they_are(log):
    def told(_share, _text):
        raise AttributeError("of a caller")

    with pytest.raises(AttributeError, match="of a caller"):
        bns.add(log, "motor-lag", NOMINAL, progress=told)


@pytest.mark.parametrize(("fault", "said"), [(0, "unknown field of Body 'heading_rad'"), (4, "Is a return missing?")])
def test_the_command_line_says_it_in_a_line(tmp_path, capsys, fault, said):
    path, log = written(tmp_path, FAULTS[fault][0]), str(FOLDER / "khepera-log.csv")
    for asked in (["add", log, str(path), "-o", str(tmp_path / "new.yaml")], ["diagnose", log, "--also", str(path)]):
        assert main([*asked, "--model", "khepera"]) == 2
        told = capsys.readouterr().err
        assert said in told
        assert "Traceback" not in told


def test_a_model_with_a_faulty_effect_is_told_where_it_is_driven(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path, "body.scaled(1 + share)")
    (tmp_path / "new.yaml").write_text(
        "{base: differential-drive, wheelbase_m: 0.1, effects: "
        f"[{{name: nap, file: {path}, values: {{share: 0.1}}, basis: guess, reason: a test}}]}}"
    )
    asked = ["run", "--world", str(tmp_path / "new.yaml"), "--trust", "--evaluations", "2", "--population-size", "10"]
    assert main(asked) == 2
    assert "Is a return missing?" in capsys.readouterr().err


def test_the_heading_as_the_page_has_it(tmp_path, log):
    body = "return body if body.place is None else body.scaled(1 + share * np.cos(2 * body.place[..., 2]))"
    found = bns.add(log, written(tmp_path, body, place=True), NOMINAL).model.effects[0]
    assert abs(found.by_name["share"]) < 0.05  # there is none in this log
    assert np.isfinite(found.by_name["share"])


@pytest.mark.parametrize("signal", SIGNALS)
def test_every_field_of_a_signal_is_documented(signal):
    page = (Path(__file__).parents[2] / "docs" / "extending.md").read_text(encoding="utf-8")
    for field in fields(signal):
        assert field.name in signal.__doc__
        assert f"`{field.name}`" in page or field.name in {"followed", "conditions"}
