"""An effect of the user's own that asks for what is not there, or fails: named with its file, not shown as a traceback."""

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import bns
from bns.api.common.own_effects import SIGNALS
from bns.cli.main import main
from bns.errors import ModelError
from bns.examples import FOLDER
from tests.diagnose.worlds import NOMINAL, measured

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


def test_a_fault_of_an_effect_in_memory_is_named_too(log):
    def apply(wheels, share):
        return wheels.turning(wheels.left, wheels.right_m_s * share)

    one = bns.Effect("mine", "wheel", (bns.Parameter("share", "1", 0.5, 2, (0.5, 2), 1.0, "x"),), "", "", (), apply)
    with pytest.raises(ModelError, match=r"^An effect in .*test_own_effects\.py \(line \d+\): unknown field of Wheels 'left'"):
        bns.add(log, one, NOMINAL)


def test_faults_of_others_stay_what_they_are(log):
    def told(_share, _text):
        raise AttributeError("of a caller")

    with pytest.raises(AttributeError, match="of a caller"):
        bns.add(log, "motor-lag", NOMINAL, progress=told)


def test_the_command_line_says_it_in_a_line(tmp_path, capsys):
    path = written(tmp_path, FAULTS[0][0])
    asked = ["add", str(FOLDER / "khepera-log.csv"), str(path), "--model", "khepera", "-o", str(tmp_path / "new.yaml")]
    assert main(asked) == 2
    assert "unknown field of Body 'heading_rad'" in capsys.readouterr().err


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
