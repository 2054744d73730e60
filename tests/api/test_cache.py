"""What is asked twice is computed once, and whatever changes is asked anew."""

import pickle

import numpy as np
import pytest

import bns
import bns.api.diagnose
from bns.api.common import cache
from bns.api.common.prepared import prepared
from bns.cli.main import main
from bns.diagnose.settings import DEFAULTS, Settings
from bns.physics.formula import formula_effect
from tests.diagnose.worlds import NOMINAL, hidden, measured


@pytest.fixture(scope="module")
def table():
    return measured(hidden(turn_slip={"slip_s": 0.12}), trials=12, commands=3)


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """How often a diagnosis was really worked out, with a cache of the test's own."""
    monkeypatch.setenv("BNS_CACHE", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    count, find = [], bns.api.diagnose.find
    monkeypatch.setattr(bns.api.diagnose, "find", lambda *a, **k: count.append(1) or find(*a, **k))
    return count


@pytest.fixture(scope="module")
def worked_out():
    """What each question to these trials has for an answer, worked out once: by the excluded effects."""
    return {}


@pytest.fixture
def answered(asked, worked_out, monkeypatch):
    """As ``asked``, where it does not matter how the answer comes about."""
    find = bns.api.diagnose.find

    def known(*given, **named):
        barred = tuple(named["barred"])
        if barred in worked_out:
            asked.append(1)
        else:
            worked_out[barred] = pickle.dumps(find(*given, **named))
        return pickle.loads(worked_out[barred])

    monkeypatch.setattr(bns.api.diagnose, "find", known)
    return asked


@pytest.fixture
def told(asked, worked_out, monkeypatch):
    """As ``asked``, where only that matters: the answer is that to the table."""
    find, told = bns.api.diagnose.find, []

    def known(*given, **named):
        told.append(1)
        if () not in worked_out:
            worked_out[()] = pickle.dumps(find(*given, **named))
        return pickle.loads(worked_out[()])

    monkeypatch.setattr(bns.api.diagnose, "find", known)
    return told


def answer(found):
    told = found.to_json()
    told.pop("provenance")
    return told


def entries(tmp_path):
    return sorted((tmp_path / "cache" / "bns" / "diagnose").glob("*"))


@pytest.mark.slow
def test_the_second_answer_is_the_first_and_costs_no_search(table, asked, tmp_path):
    first, again = (bns.diagnose(table, NOMINAL) for _ in range(2))
    assert len(asked) == 1
    assert answer(again) == answer(first)
    assert again.summary() == first.summary()
    assert again.diagnosis.selection.problem.predictor is again.ready.predictor
    bns.report(table, NOMINAL, tmp_path / "r.html", minutes=1)
    assert len(asked) == 1
    bns.diagnose(table, NOMINAL, fresh=True)
    assert len(asked) == 2


def test_the_environment_names_another_folder(table, asked, tmp_path, monkeypatch):
    monkeypatch.setenv("BNS_CACHE", str(tmp_path / "mine"))
    for _ in range(2):
        bns.compare(table, NOMINAL)
    assert len(list((tmp_path / "mine").glob("*.pickle"))) == 1
    assert not entries(tmp_path)


def test_another_model_beside_it_is_another_question(table, asked, tmp_path):
    beside = [bns.Model(NOMINAL).with_effect("motor-lag", tau_s=tau_s) for tau_s in (0.1, 0.2)]
    found = [bns.compare(table, NOMINAL, beside=one).changes.position_m.dropna().to_list() for one in (*beside, beside[0], ())]
    assert found[0] == found[2] != found[1]
    assert found[3] == []
    assert len(entries(tmp_path)) == 3


def test_whatever_changes_is_asked_again(table, told, monkeypatch):
    def ask(log=table, model=NOMINAL, **more):
        bns.diagnose(log, model, **more)
        return len(told)

    assert ask() == 1
    changed = table.copy()
    changed.loc[5, "x_m"] = np.nextafter(changed.loc[5, "x_m"], 1.0)
    assert ask(changed) == 2
    assert ask(model=NOMINAL.with_effect("motor-lag", tau_s=1e-6)) == 3
    assert ask(without_effects=["tether-pull"]) == 4
    assert ask(table[[*table.columns[::-1]]]) == 5  # the order of columns
    monkeypatch.setattr(cache, "source_sha256", lambda: "another program")
    assert ask() == 6
    assert ask() == 6


def test_settings_are_part_of_the_question(table):
    ready = prepared(table, NOMINAL)
    before = cache.key("diagnose", ready, ())
    assert cache.key("diagnose", ready, ()) == before
    assert cache.key("compare", ready, ()) != before
    other = Settings(select=type(DEFAULTS.select)(false_alarm=0.01))
    assert cache.key("diagnose", ready, (), other) != before


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: data[:-1],
        lambda data: data[:200] + bytes([data[200] ^ 1]) + data[201:],
        lambda data: b"",
        lambda data: b"bns 1\n" + bytes(32) + pickle.dumps("not this"),
    ],
)
def test_a_damaged_entry_is_none_and_is_made_again(table, answered, tmp_path, damage):
    first = bns.diagnose(table, NOMINAL)
    [entry] = entries(tmp_path)
    entry.write_bytes(damage(entry.read_bytes()))
    assert answer(bns.diagnose(table, NOMINAL)) == answer(first)
    assert len(answered) == 2
    bns.diagnose(table, NOMINAL)
    assert len(answered) == 2


def test_entries_are_bounded_and_the_oldest_go(table, answered, tmp_path, monkeypatch):
    bns.diagnose(table, NOMINAL)
    [first] = entries(tmp_path)
    monkeypatch.setattr(cache, "MOST_BYTES", int(1.5 * first.stat().st_size))
    bns.diagnose(table, NOMINAL, without_effects=["tether-pull"])
    [left] = entries(tmp_path)
    assert left != first


def test_nothing_is_kept_where_it_is_turned_off_or_cannot_be(table, asked, tmp_path, monkeypatch):
    monkeypatch.setenv("BNS_CACHE", "off")
    bns.compare(table, NOMINAL)
    assert not (tmp_path / "cache").exists()
    monkeypatch.setenv("BNS_CACHE", "")
    (tmp_path / "cache").write_text("a file in the way")
    assert bns.compare(table, NOMINAL).errors.loc["1s", "windows"] > 0


def test_effects_in_files_are_never_taken_from_before(table, told, tmp_path):
    (tmp_path / "e.py").write_text(
        "from bns.physics.effect import Effect, Parameter\n"
        "def apply(body, k):\n    return body.with_added('forward_m_s', k * body.forward_m_s)\n"
        "EFFECT = Effect(name='own', stage='body', parameters=(Parameter('k', '1', -1., 1., (-.5, .5), 0., 'x'),),\n"
        "    equation='', residuals='', lookalikes=(), apply=apply)\n"
    )
    for _ in range(2):
        bns.diagnose(table, NOMINAL, also=[tmp_path / "e.py"])
    assert len(told) == 2


def test_formulas_can_be_kept():
    effect = pickle.loads(pickle.dumps(formula_effect("f", "k * v * abs(w)", "v")))
    assert effect.parameters[0].name == "k"


def test_the_command_line_asks_once_unless_it_is_told_otherwise(table, asked, tmp_path, capsys):
    table.to_csv(tmp_path / "d.csv", index=False)
    for more in ([], [], ["--fresh"]):
        assert main(["diagnose", str(tmp_path / "d.csv"), "--model", "khepera", *more]) == 0
        assert "turn-slip" in capsys.readouterr().out
    assert len(asked) == 2
