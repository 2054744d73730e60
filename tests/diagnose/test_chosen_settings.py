"""Settings of the user's own: checked, in force in every module while they last, said in the answer, and gone afterwards."""

import ast
import threading
from pathlib import Path

import pytest

import bns
from bns.cli.main import main
from bns.diagnose.data import checks, spread, tracker_faults
from bns.diagnose.data.bodies import joints
from bns.diagnose.residuals import ranked_families as ranking
from bns.diagnose.select import stepwise
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.settings.chosen import _TURNS, _lines, in_force, settings_of
from bns.errors import DataError
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, hidden, measured

STRICT = {"select": {"min_gain": 1e6}}
HANGS_S = 30.0


@pytest.fixture(scope="module")
def table():
    return measured(hidden(turn_slip={"slip_s": 0.12}), trials=12, commands=3)


@pytest.mark.slow
def test_a_setting_decides_the_verdict_and_is_said(table):
    barred = all_but_rivals_of("turn-slip")
    assert bns.diagnose(table, NOMINAL, without_effects=barred).effects == ("turn-slip",)
    found = bns.diagnose(table, NOMINAL, settings=STRICT, without_effects=barred)
    assert found.effects == ()
    assert f"setting select.min_gain: 1000000.0 (default: {DEFAULTS.select.min_gain})" in found.summary()
    told = found.to_json()["provenance"]
    assert told["settings_changed"] == {"select": {"min_gain": 1e6}}
    assert told["settings_digest"] != DEFAULTS.digest()
    again = bns.diagnose(table, NOMINAL, without_effects=barred)
    assert again.effects == ("turn-slip",)
    assert again.to_json()["provenance"]["settings_changed"] == {}
    assert "setting" not in again.summary().splitlines()[0]


def test_the_command_line_takes_a_file(table, tmp_path, capsys):
    table.to_csv(tmp_path / "d.csv", index=False)
    (tmp_path / "s.yaml").write_text("select:\n  min_gain: 1.0e6\n")
    arguments = ["diagnose", str(tmp_path / "d.csv"), "--model", "khepera", "--settings", str(tmp_path / "s.yaml")]
    assert main(arguments) == 0
    assert "setting select.min_gain" in capsys.readouterr().out
    (tmp_path / "s.yaml").write_text("select:\n  min_gian: 1\n")
    assert main(arguments) == 2
    assert "Did you mean 'min_gain'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("tree", "message"),
    [
        ({"selct": {}}, "unknown room of settings 'selct'. Did you mean 'select'"),
        ({"select": {"min_gian": 1}}, "unknown setting 'min_gian'"),
        ({"select": 3}, "must be lines of name: value"),
        ({"select": {"min_gain": "much"}}, "select.min_gain is 'much'; it must be a finite number"),
        ({"select": {"min_gain": float("nan")}}, "must be a finite number"),
        ({"select": {"min_gain": -1.0}}, "must not be below 0"),
        ({"select": {"most_effects": 2.5}}, "must be a whole number"),
        ({"select": {"most_effects": True}}, "must be a whole number"),
        ({"predict": {"horizons_s": 3}}, "must be a list like"),
        ("select", "settings are rooms"),
    ],
)
def test_what_is_no_setting_is_refused(tree, message, tmp_path):
    given = tree
    if isinstance(tree, str):
        given = tmp_path / "s.yaml"
        given.write_text(tree)
    with pytest.raises(DataError, match=message):
        settings_of(given)


def test_copies_of_a_setting_in_other_modules_follow_it():
    other = settings_of({"data": {"jump_m": 0.5}, "select": {"min_gain": 0.25}})
    before = checks._JUMP_M, tracker_faults.LEAST_M, stepwise.MIN_GAIN
    with in_force(other):
        assert (checks._JUMP_M, tracker_faults.LEAST_M) == (0.5, 0.5)
        assert stepwise.MIN_GAIN == 0.25
        from bns.diagnose import diagnosing

        assert diagnosing.MIN_GAIN == 0.25
    assert before == (checks._JUMP_M, tracker_faults.LEAST_M, stepwise.MIN_GAIN)


def test_names_that_are_given_together_follow_their_settings():
    chosen = settings_of({
        "data": {"set_point_beyond": 0.7, "set_point_turns_rad": 9.0, "at_rest": [0.5, 0.25]}, "residuals": {"large_z": 7.0},
    })  # fmt: skip
    before = joints._BEYOND, joints._TURNS_RAD, spread._FAR_M, spread._FAR_RAD, ranking.LARGE, ranking.LARGE_Z
    with in_force(chosen):
        assert (joints._BEYOND, joints._TURNS_RAD) == (0.7, 9.0)
        assert (spread._FAR_M, spread._FAR_RAD) == (0.5, 0.25)
        assert (DEFAULTS.residuals.large, 7.0) == (ranking.LARGE, ranking.LARGE_Z)
    assert before == (joints._BEYOND, joints._TURNS_RAD, spread._FAR_M, spread._FAR_RAD, ranking.LARGE, ranking.LARGE_Z)


def test_an_error_puts_the_defaults_back():
    with pytest.raises(RuntimeError), in_force(settings_of({"data": {"jump_m": 0.5}})):
        raise RuntimeError
    assert DEFAULTS.data.jump_m == checks._JUMP_M


def test_every_setting_of_every_module_can_be_chosen():
    """What names a setting is a line that is read again; defaults of functions would keep the old value."""
    names = {name for _, name, _, _ in _lines()} | {"DEFAULTS"}
    root = Path(bns.__file__).parent / "diagnose"
    for path in root.rglob("*.py"):
        if path.parent.name == "settings":
            continue
        tree = ast.parse(path.read_text())
        inside = {id(one) for node in tree.body for one in ast.walk(node) if isinstance(node, ast.Assign | ast.AnnAssign)}
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.Lambda):
                given = [*node.args.defaults, *filter(None, node.args.kw_defaults)]
                used = {one.id for default in given for one in ast.walk(default) if isinstance(one, ast.Name)}
                assert not used & names, f"{path}:{node.lineno}: a default of a function is read once"
            if isinstance(node, ast.Name) and node.id == "DEFAULTS":
                assert id(node) in inside, f"{path}:{node.lineno}"


def test_questions_under_other_settings_wait_for_those_under_way():
    seen, asking, go = [], threading.Event(), threading.Event()

    def usual():
        with in_force(DEFAULTS):
            asking.set()
            go.wait(5)
            seen.append(checks._JUMP_M)

    thread = threading.Thread(target=usual)
    thread.start()
    asking.wait(5)
    threading.Timer(0.1, go.set).start()
    with in_force(settings_of({"data": {"jump_m": 0.5}})):
        seen.append(checks._JUMP_M)
    thread.join()
    assert seen == [DEFAULTS.data.jump_m, 0.5]


def test_all_that_wait_for_a_question_under_other_settings_go_on_when_it_is_answered(monkeypatch):
    """Those under the default settings together: each of them waits for the others here."""
    strict, seen, waiting, together = settings_of({"data": {"jump_m": 0.5}}), [], threading.Semaphore(0), threading.Barrier(3)
    wait = _TURNS._free.wait
    monkeypatch.setattr(_TURNS._free, "wait", lambda *given: (waiting.release(), wait(*given))[1])

    def ask(settings):
        with in_force(settings):
            if settings == DEFAULTS:
                together.wait(HANGS_S)
            seen.append(checks._JUMP_M)

    threads = [threading.Thread(target=ask, args=(each,)) for each in (DEFAULTS, DEFAULTS, strict, DEFAULTS)]
    with in_force(settings_of({"data": {"jump_m": 0.25}})):
        for thread in threads:
            thread.start()
            assert waiting.acquire(timeout=HANGS_S)
    for thread in threads:
        thread.join(2 * HANGS_S)
    assert sorted(seen) == sorted([0.5, *[DEFAULTS.data.jump_m] * 3])
