"""Model files are data: no Python runs that nobody allowed, and whatever is wrong in one is answered in words, with the line."""

import re
import time

import numpy as np
import pytest

from bns.errors import ModelError
from bns.physics.effects import effect_named
from bns.physics.formula import formula_effect
from bns.physics.model import load_model, parse_model
from bns.physics.signals import Body
from bns.physics.trust import VARIABLE, trust

HEAD = "base: differential-drive\nwheelbase_m: 0.1\n"
WHY = "basis: guess, reason: a test"
EFFECT = f"""{HEAD}effects:
  - name: drag
    file: e.py
    values: {{k: 0.1}}
    {WHY.replace(", ", chr(10) + "    ")}
"""
PROGRAM = """
from pathlib import Path
from bns.physics.formula import formula_effect
Path(__file__).with_name("ran").touch()
EFFECT = formula_effect("drag", "k * v", "v")
"""
LOG = "trial,t_s,left_m_s,right_m_s,x_m,y_m,heading_rad\n" + "".join(
    f"{trial},{n / 10},0.1,0.1,{n / 100},0,0\n" for trial in (1, 2) for n in range(200)
)


@pytest.fixture
def colleague(tmp_path, monkeypatch):
    """A model of a colleague's, with a program beside it."""
    monkeypatch.setenv(VARIABLE, "")
    (tmp_path / "e.py").write_text(PROGRAM)
    (tmp_path / "log.csv").write_text(LOG)
    path = tmp_path / "model.yaml"
    path.write_text(EFFECT)
    return path


def model(term, on="v", values="{k: 0.1}", extra=""):
    return f"{HEAD}effects:\n  - {{name: mine, term: {term!r}, on: {on}, values: {values}, {WHY}{extra}}}\n"


def test_program_of_a_model_does_not_run_unless_it_is_allowed(colleague):
    hint = r"line 4: .* names the Python file .*e\.py.* not run.*--trust-file .*e\.py; --trust .*BNS_TRUST"
    with pytest.raises(ModelError, match=hint):
        load_model(colleague)
    assert not colleague.with_name("ran").exists()
    trust([colleague.with_name("other.py")])
    with pytest.raises(ModelError, match="is not run"):
        load_model(colleague)
    trust([colleague.with_name("e.py")])
    assert [active.by_name for active in load_model(colleague).effects] == [{"k": 0.1}]
    assert colleague.with_name("ran").exists()


@pytest.mark.parametrize("command", ["compare", pytest.param("run", marks=pytest.mark.slow)])
def test_commands_refuse_the_program_and_say_how_to_allow_it(colleague, bns, command):
    words = {
        "compare": ["compare", colleague.with_name("log.csv"), "--model", colleague],
        "run": ["run", "--world", colleague, "--evaluations", 1, "--generations-per-evaluation", 1, "--population-size", 4,
                "--training-iterations-per-evaluation", 1, "--results", colleague.with_name("results")],
    }[command]  # fmt: skip
    refused = bns(*words, BNS_TRUST="")
    assert refused.returncode == 2
    assert "--trust" in refused.stderr
    assert "Traceback" not in refused.stderr
    assert not colleague.with_name("ran").exists()
    allowed = bns(*words, "--trust", BNS_TRUST="")
    assert allowed.returncode == 0, allowed.stderr
    assert colleague.with_name("ran").exists()


def test_what_is_wrong_names_the_file(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("base: foo\nwheelbase_m: 0.1\n")
    with pytest.raises(ModelError, match=re.escape(f"{path}: ") + ".*unknown base 'foo'"):
        load_model(path)


def test_documented_form_of_a_formula_works():
    entry = "  - name: rub\n    term: k * v * abs(w)\n    on: v\n    values: {k: 0.1}\n    basis: guess\n    reason: x\n"
    text = f"{HEAD}effects:\n{entry}"
    (active,) = parse_model(text, "m").effects
    assert active.written == {"term": "k * v * abs(w)", "on": "v"}


def deep(levels):
    return "(" * levels + "k" + ")" * levels


@pytest.mark.parametrize(
    ("term", "message"),
    [
        ("9**9**9**9", "cannot be used"),
        ("k * 10**13", "at most 1e[+]12"),
        ("k * 1e400", "cannot be used"),
        ("max(v)", "has 1 arguments; max takes 2"),
        ("abs(v, k)", "has 2 arguments; abs takes 1"),
        ("min(v, k, w)", "has 3 arguments; min takes 2"),
        ("abs(x=k)", "1 arguments"),
        ("k/0", "divides by zero"),
        ("k/(2 - 2)", "divides by zero"),
        ("k * (-1)**0.5", "cannot be used: it must be a real number"),
        ("k * log(0)", "cannot be used"),
        ("k * sqrt(-2)", "cannot be used"),
        ("k * exp(1000)", "cannot be used"),
        (" + ".join(["k * v"] * 3000), "must be a text of 1 to 2000"),
        ("+".join(["k"] * 150), "too long for a formula"),
        (deep(150), "too many nested|is no formula|k"),
        ("k * abs", "abs is a function; write abs"),
        ("k * True", "is not allowed"),
        ("k * 'a'", "is not allowed"),
        ("k if v else w", "is not allowed"),
        ("(lambda: k)()", "unknown function|not allowed"),
        ("__import__('os').system('true')", "unknown function"),
        ("k.__class__", "is not allowed"),
        ("[k for k in v]", "is not allowed"),
        ("k :=", "is no formula"),
        ("", "must be a text"),
        ("v * w", "no number to fit"),
        ("k * " + "9" * 1900, "cannot be used"),
    ],
)
def test_formulas_that_cannot_be_calculated_are_refused_at_once(term, message):
    began = time.process_time()
    if term == deep(150):  # brackets alone are no levels
        formula_effect("f", term, "v")
        return
    with pytest.raises(ModelError, match=f"formula f.*({message})"):
        formula_effect("f", term, "v")
    assert time.process_time() - began < 5


@pytest.mark.parametrize("term", ["k / (k - k)", "(-k) ** 0.5 * v", "k * v / (t - t)", "k ** 400 ** 3"])
def test_formulas_that_fail_with_their_numbers_say_so(term):
    ones = np.ones((1, 3))
    body = Body(ones, ones, ones, ones, ones, ones, ones)
    with pytest.raises(ModelError, match="formula f"):
        formula_effect("f", term, "v").apply(body, k=2.0)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        (model("k * v", extra=", intervals: 3"), 4, "must be a mapping with the keys k"),
        (model("k * v", extra=", intervals: {k: 3}"), 4, r"it must be two numbers: \[0.1, 0.2\]"),
        (model("k * v", extra=", intervals: {k: [a, b]}"), 4, "two numbers"),
        (model("max(v)"), 4, "max takes 2"),
        (model("k * v", on="q"), 4, "unknown velocity to add to"),
        (model("k * v", values="{k: x}"), 4, "must be a number"),
        (f"{HEAD}provenance: 3\n", None, "provenance of model m is 3"),
        (f"{HEAD}effects: 3\n", None, "effects is 3"),
        ("base: differential-drive\n\nwheelbase_m: -1\n", 3, "must be a number from 0.001"),
        (f"{HEAD}jitter: 3\n", 3, "must be a mapping"),
        (f"{HEAD}jitter: {{wheel_speed_relative: 0.1, basis: [1], reason: x}}\n", 3, "unknown basis"),
        (f"{HEAD}{HEAD}", 3, "the key 'base' is already given on line 1"),
        (f"{HEAD}effects: [\n", None, "no valid YAML"),
        (f"{HEAD}dt_s: !!python/object/apply:os.system [true]\n", 3, "could not determine a constructor"),
        ("[" * 5000, 1, "nested too deeply"),
        (f"{HEAD}effects: {'[' * 30}{']' * 30}\n", None, "nested too deeply: 3. levels"),
        (f"{HEAD}effects: &a [*a]\n", 3, "an alias contains itself"),
        ("3", None, "must be a mapping"),
        ("", None, "is empty; it needs at least base"),
        ("\x00", None, "special characters are not allowed"),
        ("a: " + "x" * 200_000, None, "200003 characters; 131072 are allowed"),
    ],
)
def test_models_that_are_wrong_are_answered_in_words_with_the_line(text, line, message):
    with pytest.raises(ModelError, match=message) as caught:
        parse_model(text, "m")
    assert len(str(caught.value)) < 2000
    if line is not None:
        assert re.search(rf"line {line}\b", str(caught.value))


def test_aliases_that_stand_for_millions_are_refused_at_once():
    bomb = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
        f"{after}: &{after} [{','.join([f'*{before}'] * 9)}]\n" for before, after in zip("abcdefgh", "bcdefghi", strict=True)
    )
    began = time.process_time()
    with pytest.raises(ModelError, match="keys and values with all aliases; 50000 are allowed"):
        parse_model(f"{HEAD}{bomb}", "m")
    assert time.process_time() - began < 5


def test_aliases_of_a_sensible_size_are_fine():
    text = f"{HEAD}jitter: &why {{wheel_speed_relative: 0.1, {WHY}}}\nprovenance: {{as: *why}}\n"
    assert parse_model(text, "m").jitter_relative == 0.1


def test_files_that_are_no_text_are_named(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_bytes(HEAD.encode() + b"# caf\xe9\n")
    with pytest.raises(ModelError, match=rf"cannot read the model {path}: it is no UTF-8 text \(byte 47\). Save it as UTF-8"):
        load_model(path)


def test_effects_of_the_catalogue_need_no_trust(monkeypatch):
    monkeypatch.setenv(VARIABLE, "")
    assert effect_named("motor-lag").name == "motor-lag"
