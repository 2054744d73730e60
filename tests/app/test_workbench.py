"""What the page shows without a browser: the numbers are those of the command line, and every change has a way back."""

import importlib
import json
import time

import pytest

import bns
from bns.api.compare import compare
from bns.app.background import Background
from bns.app.explore import tabs_of
from bns.app.log.part import Part
from bns.app.same_elsewhere import commands, python
from bns.app.session import opened, session_yaml
from bns.app.switches import History, Switches, Term
from bns.app.tab import Tab, Tabs, mapping_of
from bns.app.workbench import BY_HAND, Workbench
from bns.cli.main import main
from bns.diagnose.data.mapping import load_mapping
from bns.diagnose.predict.paired_errors import paired_errors
from bns.errors import DataError
from bns.examples import FOLDER
from bns.measurements import write_measurements
from tests.app.numbers import rows_of

LOG = FOLDER / "khepera-log.csv"
BOTH = Switches().switched("motor-lag", True).switched("turn-slip", True)


@pytest.fixture(scope="module")
def bench():
    return Workbench(LOG, "khepera")


def printed(capsys, *arguments):
    assert main([*map(str, arguments)]) == 0
    return json.loads(capsys.readouterr().out)


def test_the_list_of_errors_is_that_of_bns_add(bench, capsys, tmp_path):
    shown = bench.shown(BOTH)
    said = printed(capsys, "add", LOG, *BOTH.on, "--model", "khepera", "-o", tmp_path / "new.yaml", "--json")
    assert shown.errors.as_json() == said["error"]
    assert shown.names == ["as given", *BOTH.on]
    assert shown.numbers == said["parameters"]
    assert list(shown.warnings) == said["warnings"]
    assert shown.model.sha256 == bns.Model(tmp_path / "new.yaml").sha256


def test_the_model_as_given_is_judged_as_bns_compare_judges_it(bench, capsys):
    said = printed(capsys, "compare", LOG, "--model", "khepera", "--json")["error"]
    rms = {h: e.models[0].rms_m for h, e in bench.as_given.errors.horizons.items()}
    assert rms == pytest.approx({h: e["position_m"] for h, e in said.items()}, rel=1e-12)
    windows = bench.windows(bench.as_given.steps[0], "1s")
    assert float((windows["error_mm"] ** 2).mean() ** 0.5) == pytest.approx(1e3 * said["1s"]["position_m"], rel=1e-9)


def test_a_number_moved_by_hand_is_judged_like_the_saved_model_and_nothing_is_fitted(bench, tmp_path):
    fitted = bench.shown(BOTH)
    moved = bench.shown(BOTH.moved("motor-lag", "tau_s", 0.1))
    saved = bns.Model(moved.model.save(tmp_path / "hand.yaml"))
    assert saved.values_of("motor-lag") == {"tau_s": 0.1}
    errors = compare(LOG, saved).errors
    e = moved.errors.horizons["1s"]
    assert [m.name for m in e.models] == [*fitted.names, BY_HAND]
    assert e.models[-1].rms_m == pytest.approx(errors.loc["1s", "position_m"], rel=1e-9)
    assert e.models[:-1] == fitted.errors.horizons["1s"].models
    assert saved.effects[0].basis == "guess"
    began = time.process_time()
    bench.shown(BOTH.moved("motor-lag", "tau_s", 0.11))
    assert time.process_time() - began < 0.3


def counted(monkeypatch, path, name):
    """Calls of a function so far."""
    module, calls = importlib.import_module(path), []
    whole = getattr(module, name)
    monkeypatch.setattr(module, name, lambda *arguments: calls.append(arguments) or whole(*arguments))
    return calls


def test_noise_is_estimated_once_for_the_model_as_given_and_not_to_judge_it(monkeypatch):
    fresh, calls = Workbench(LOG, "khepera"), counted(monkeypatch, "bns.diagnose.estimate.problem", "estimate_noise")
    assert fresh.as_given
    assert calls == []
    first = fresh.shown(Switches().switched("motor-lag", True))
    of_first = len(calls)
    second = fresh.shown(Switches().switched("turn-slip", True))
    assert len(calls) - of_first == of_first - 1
    for shown, name in ((first, "motor-lag"), (second, "turn-slip")):  # what is remembered changes no number
        alone = bns.add(LOG, name, "khepera").to_json()
        assert shown.errors.as_json() == alone["error"]
        assert shown.numbers == alone["parameters"]


def test_only_the_moved_model_is_judged_again(bench, monkeypatch):
    bench.shown(BOTH.moved("motor-lag", "tau_s", 0.12))
    calls = counted(monkeypatch, "bns.diagnose.predict.paired_errors", "errors_of")
    moved = bench.shown(BOTH.moved("motor-lag", "tau_s", 0.13))
    predictor = bench.ready.predictor
    assert len(calls) == len(predictor.horizons)
    afresh = paired_errors(predictor, list(zip(moved.names, moved.steps, strict=True)))
    assert moved.errors.as_json() == afresh.as_json()


def test_a_fit_that_is_there_is_not_made_again(bench):
    bench.shown(BOTH)
    began = time.process_time()
    assert bench.shown(BOTH) is bench.shown(BOTH)
    assert time.process_time() - began < 0.01


def test_badges_say_what_does_nothing_and_what_nobody_believes(bench):
    assert bench.shown(BOTH).badges == {"motor-lag": (), "turn-slip": ("has no visible effect in these data",)}
    [badge] = bench.shown(Switches().switched("understeer", True)).badges["understeer"]
    assert badge.startswith("implausible: loss_s_m = ")


def test_a_formula_is_fitted_like_an_effect(bench, capsys, tmp_path):
    state = Switches().with_term(Term("mine", "k * v", "v"))
    said = printed(
        capsys, "add", LOG, "mine", "--term", "k * v", "--model", "khepera", "-o", tmp_path / "m.yaml", "--json"
    )
    assert bench.shown(state).errors.as_json() == said["error"]


def test_undo_goes_back_one_change_at_a_time_and_a_slider_is_one():
    history = History()
    history.to(history.now.switched("motor-lag", True))
    for value in (0.1, 0.2, 0.3):
        history.to(history.now.moved("motor-lag", "tau_s", value))
    assert dict(history.now.by_hand) == {("motor-lag", "tau_s"): 0.3}
    history.undo()
    assert history.now == Switches(("motor-lag",))
    history.redo()
    assert history.now.by_hand
    history.undo()
    history.undo()
    history.undo()
    assert history.now == Switches()
    history.to(history.now.switched("wheelbase", True))
    history.redo()
    assert history.now.on == ("wheelbase",)


def test_trials_that_are_left_out_take_no_part():
    tab = Tab()
    tab.open(LOG, str(LOG))
    first = tab.log.trials["trial"].iloc[0]
    tab.take_part(Part((str(first),)))
    assert len(tab.bench.ready.log) == len(tab.log) - 1
    assert tab.bench.ready.log.name == "khepera-log.csv"
    with pytest.raises(DataError, match="All trials are left out"):
        tab.take_part(Part(tuple(map(str, tab.log.trials["trial"]))))
    with pytest.raises(DataError, match="There is no trial 99"):
        tab.log.without(["99"])
    assert tab.part.trials == (str(first),)


def test_a_log_without_a_mapping_is_read_with_one_of_the_users(tmp_path):
    other = tmp_path / "other.csv"
    other.write_bytes(LOG.read_bytes())
    tab = Tab()
    with pytest.raises(DataError, match="lack"):
        tab.upload(tab.keep({"../other.csv": other.read_bytes()}))
    assert (tab.folder / "other.csv").is_file()
    tab.open(other, "other.csv", mapping_of((FOLDER / "khepera-log.csv.import.yaml").read_text()))
    assert len(tab.log) == 14
    for text in ("columns: [", "just words"):
        with pytest.raises(DataError):
            mapping_of(text)


def test_the_data_suggest_a_wheelbase():
    assert bns.Measurements(LOG).suggested_wheelbase_m == pytest.approx(0.0884, rel=0.05)


def test_tabs_do_not_share_their_switches():
    tabs = Tabs(Tab())
    (name, one), (_, other) = tabs.get(""), tabs.get("nobody")
    one.history.to(one.now.switched("motor-lag", True))
    assert other.now == Switches()
    assert tabs.get(name)[1] is one


def test_a_diagnosis_in_the_background_can_be_stopped_and_begun_again():
    work = Background()
    work.start("diagnosing", lambda tell: bns.diagnose(LOG, "khepera", progress=tell))
    assert work.at_work
    work.stop()
    work.wait(60)
    assert (work.result, work.why) == (None, "stopped")


def test_what_to_type_gives_the_same(tmp_path, monkeypatch, capsys, bench):
    monkeypatch.chdir(tmp_path)
    typed = commands([str(LOG)], ("khepera",), BOTH.with_term(Term("mine", "k * v", "v")))
    assert typed[2] == f"bns add {LOG} motor-lag turn-slip --model khepera -o extended.yaml"
    assert typed[3] == f"bns add {LOG} mine --term 'k * v' --on v --model extended.yaml -o extended.yaml"
    lines = python([str(LOG)], ("khepera",), BOTH.moved("motor-lag", "tau_s", 0.1))
    slow = ["found = bns.diagnose(log, model)", "print(found.summary())", 'found.report("report.html")']
    assert [line for line in lines.splitlines() if "found" in line] == slow
    exec("\n".join(line for line in lines.splitlines() if line not in slow), {})
    capsys.readouterr()
    saved = bns.Model("extended.yaml")
    assert rows_of(saved) == rows_of(bench.shown(BOTH.moved("motor-lag", "tau_s", 0.1)).model)


def test_with_no_effect_on_no_extended_model_is_saved():
    plain = Switches()
    assert "extended.yaml" not in "\n".join(commands([str(LOG)], ("khepera",), plain))
    lines = python([str(LOG)], ("khepera",), plain).splitlines()
    assert "extended.yaml" not in "\n".join(lines)
    assert lines[-1] == 'found.report("report.html")'


def test_several_files_are_written_one_by_one(tmp_path):
    other = tmp_path / "the other.csv"
    table = bns.Measurements(LOG).frame
    write_measurements(table.assign(x_m=table.x_m + 0.1), other)
    tabs = tabs_of([str(LOG), str(other)], bns.Model("khepera"), [str(LOG), str(other)])
    typed = commands(tabs.first.data_words, ("khepera",), BOTH.with_term(Term("mine", "k * v", "v")))
    assert typed[0] == f"bns compare {LOG} --model khepera --more '{other}'"
    assert typed[3].endswith(f"--model extended.yaml --more '{other}' -o extended.yaml")
    lines = python(tabs.first.data_words, ("khepera",), Switches())
    assert f"log = bns.Measurements({str(LOG)!r}, {str(other)!r})" in lines


def test_what_was_left_out_is_saved_and_read_again(tmp_path):
    tab = Tab()
    tab.open(LOG, str(LOG))
    first, second = map(str, tab.log.trials["trial"].iloc[:2])
    part = Part((first,), (int(tab.log.findings["row"].iloc[-1]),), ((second, 1.0, 5.5),))
    tab.take_part(part)
    saved = tmp_path / "a.session.yaml"
    saved.write_text(session_yaml(tab))
    again = opened(saved)
    assert again.part == part
    assert again.used.sha256 == tab.used.sha256 != tab.log.sha256
    tab.take_part(Part())
    assert tab.used.sha256 == tab.log.sha256
    saved.write_text(saved.read_text().replace("from_s: 1.0", "from_s: soon"))
    with pytest.raises(DataError, match="cuts lists"):
        opened(saved)


def test_python_reads_columns_as_the_menus_had_them(tmp_path):
    mapping = {**load_mapping(LOG.with_name(LOG.name + ".import.yaml")), "hold_commands_s": float("inf")}
    text = python([str(LOG)], ("khepera",), Switches(), mapping=mapping)
    names = {}
    exec(text.split("model =")[0], names)
    assert names["log"].sha256 == bns.Measurements(LOG, mapping=mapping).sha256
