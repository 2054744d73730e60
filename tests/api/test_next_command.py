"""Commands that are printed for the next step ask the same again: they hold all that was given. What is said in a message
of an option is said for Python, too."""

import ast
import math
import re
import shlex
from pathlib import Path
from types import SimpleNamespace

import pytest

import bns
from bns.api.common.next_command import limits_in_words, model_words, noted, repeated
from bns.api.common.prepared import prepared
from bns.api.measurements import SAVED
from bns.api.propose import ProposeResult
from bns.cli.main import _parser
from bns.cli.options.measuring_options import words_of
from bns.cli.values import arena_of, pose_of, speeds_of
from bns.diagnose.report.proposal_text import _next, proposal_text
from bns.diagnose.report.tables import next_commands
from bns.errors import DataError
from bns.measurements import write_measurements
from tests.diagnose.worlds import NOMINAL, measured

OWN = (
    "from dataclasses import replace\nfrom bns.physics.effect import Effect, Parameter\n"
    "def apply(body, k):\n    return replace(body, forward_m_s=body.forward_m_s * (1 - k * abs(body.yaw_rad_s)))\n"
    "EFFECT = Effect('my-drag', 'body', (Parameter('k', 's', -1.0, 1.0, (-0.5, 0.5), 0.0, 'drag'),), 'v(1-k|w|)', "
    "'arcs too short', (), apply)\n"
)
SHARED = ("--more", "more log.csv", "--robot", "ada", "--without", "b c", "--without=-3")
"""What every command takes."""
SEARCH = ("--without-effect", "motor-lag", "--settings", "s.yaml")
AREA = ("--arena", "1.8x1.3", "--speeds=-0.2,0.2")


@pytest.fixture
def own(tmp_path):
    path = tmp_path / "my drag.py"
    path.write_text(OWN)
    return path


@pytest.fixture
def given(own):
    """The options of a command line that has all of them."""
    base = ["my log.csv", "--model", "my model.yaml", "--wheelbase", "0.1", *SHARED, "--also", str(own), "--trust", *SEARCH]
    return _parser().parse_args(["propose", *base, *AREA, "--minutes", "3", "--start", "0,0,90"])


def found_with(*effects, terms=(), formula=None):
    return SimpleNamespace(effects=effects, terms=terms, formula=formula)


def asked(command):
    """What a printed command is understood as, and that its shell would take it so."""
    words = shlex.split(command)
    assert words[0] == "bns"
    return vars(_parser().parse_args(words[1:]))


def same(command, options, *names):
    said = asked(command)
    for name in names:
        assert said[name] == getattr(options, name), name


ALWAYS = ("data", "model", "wheelbase", "more", "robot", "without", "trust")
SEARCHED = (*ALWAYS, "also", "without_effect", "settings")


def test_every_command_that_follows_a_diagnosis_holds_what_was_given(given, own):
    words = words_of(given)
    formula = SimpleNamespace(name="left", term="k * v", on="v")
    plan = SimpleNamespace(plan=[1], bounds=SimpleNamespace(robot="khepera"))
    add, hint, propose, trial, again = next_commands(found_with("motor-lag", "my-drag", formula=formula), plan, words)
    for name in ("data", "model", "wheelbase", "more", "robot", "without", "trust"):
        assert asked(add)[name] == getattr(given, name)
    assert asked(add)["effects"] == ["motor-lag", str(own)]  # its name is known to nobody but its file
    assert asked(hint)["model"] == "extended.yaml"
    assert asked(hint)["wheelbase"] is None  # the file has it
    same(hint, given, "data", "more", "robot", "without", "trust")
    assert asked(hint)["trust_file"] == asked(add)["trust_file"] == [str(own)]  # the extended model names it
    same(propose, given, *SEARCHED, "minutes", "arena", "speeds", "start")
    assert asked(trial)["robot"] == "khepera"
    driven = asked(again)
    assert [str(file) for file in driven["more"]] == ["more log.csv", "results/trials/experiment-next/measurements.csv"]
    same(again, given, *(name for name in SEARCHED if name != "more"))
    (written, *_) = next_commands(found_with(terms=(1,)), None, words)
    same(written, given, *SEARCHED)


def test_what_was_not_given_is_not_written():
    options = _parser().parse_args(["report", "log.csv", "--model", "khepera"])
    plan = SimpleNamespace(plan=[1], bounds=None)
    commands = next_commands(found_with("motor-lag"), plan, words_of(options))
    assert commands == [
        "bns add log.csv motor-lag --model khepera -o extended.yaml",
        "bns propose log.csv --model khepera -o next.csv",
        "bns diagnose log.csv --model khepera --more NEW-LOG.csv",
    ]


def test_a_plan_for_another_start_keeps_the_arena(given):
    arena = SimpleNamespace(x_low_m=0, x_high_m=1, y_low_m=0, y_high_m=1, start=(0.5, 0.2, 0.0))
    bounds = SimpleNamespace(robot="khepera", slowest_m_s=0.0, fastest_m_s=0.2)
    plan = type("Plan", (), {"lasting_s": SimpleNamespace(sum=lambda: 60, mean=lambda: 6), "__len__": lambda _: 1})()
    proposal = SimpleNamespace(
        verdict="tie", competing_models=(), model_pairs=(), arena=arena, bounds=bounds, plan=plan, minutes=3.0
    )
    lines = proposal_text(proposal, "next.csv", words_of(given)).split("\n")
    again = next(line for line in lines if "bns propose" in line)
    same(again[again.index("bns propose") :], given, *SEARCHED, "minutes", "arena", "speeds")
    assert asked(again[again.index("bns propose") :])["start"] == "0,0,90"
    then = lines[-1].removeprefix("then: ")
    same(then, given, *(name for name in SEARCHED if name != "more"))


def test_python_repeats_what_it_was_given(tmp_path, own):
    table = measured(NOMINAL, trials=4).assign(robot="ada")
    data, more = tmp_path / "log.csv", tmp_path / "more.csv"
    write_measurements(table, data)
    write_measurements(measured(NOMINAL, trials=4, seed=1).assign(robot="ada"), more)
    log = bns.Measurements(data, more, robot="ada").without(["2"]).without(["1-more: 3"])
    found = bns.diagnose(log, bns.Model(wheelbase_m=0.0884), also=[own], without_effects=["motor-lag"])
    command = f"bns diagnose {found.command['data']} {found.command['search']}"
    said = asked(command)
    assert (said["data"], said["more"], said["robot"]) == (data, [more], "ada")
    assert (said["model"], said["wheelbase"]) == ("differential-drive", 0.0884)
    assert (said["without"], said["also"], said["without_effect"]) == (["2", "1-more: 3"], [str(own)], ["motor-lag"])
    NOMINAL_FILE = tmp_path / "mine.yaml"
    bns.Model("khepera").save(NOMINAL_FILE)
    found = bns.diagnose(data, NOMINAL_FILE, settings={"verdict": {"few_trials": 31}})
    assert found.command["model"] == f"--model {NOMINAL_FILE}"
    found = bns.diagnose(log, "khepera", settings={"data": {"jump_m": 0.5}})  # read again under these
    assert found.command["model"].endswith("--robot ada --without 2 --without '1-more: 3'")
    assert found.ready.log.name == "log.csv"


def in_memory(table, path):
    """Measurements that no file holds, each its own way."""
    table.to_csv(path, index=False)
    log = bns.Measurements(path)
    yield bns.Measurements(table)
    yield bns.Measurements(path, mapping={"columns": {"x_m": {"from": "x_m", "unit": "m"}}})
    yield log.without(["2"]).without_rows([3])
    yield log.without_rows([3]).without(["2"])


def test_what_is_only_in_memory_is_written_before_a_command_reads_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = measured(NOMINAL, trials=4)
    for log in in_memory(table, tmp_path / "log.csv"):
        found = bns.diagnose(log, "khepera")
        assert found.command["data"] == "measurements.csv"
        assert "--without" not in found.command["model"]
        first, *then = next_commands(found_with("motor-lag"), None, found.command)
        assert first == f"# first, in Python: {SAVED}"
        assert asked(then[0])["data"].name == "measurements.csv"
        exec(SAVED, {"log": log})
        again = bns.Measurements("measurements.csv")
        assert again.trials.equals(log.trials)
        assert not again.only_in_memory
        text = noted(f"to try it: bns add {found.command['data']}", found.command)
        assert text.endswith(f"The commands read measurements.csv. Write it first, in Python: {SAVED}")
    assert "before" not in bns.diagnose("measurements.csv", "khepera").command
    assert noted("bns add measurements.csv", {"data": "measurements.csv"}) == "bns add measurements.csv"


@pytest.mark.parametrize("arena", [(1.8, 1.3), (-0.5, 1.3, 0.0, 1.25), None])
def test_limits_of_python_are_those_of_the_command_line(arena):
    words = limits_in_words(3, arena, (0.1, -0.2, math.pi / 2), (-0.2, 0.15))
    said = _parser().parse_args(shlex.split(f"propose log.csv --model khepera {words['limits']}"))
    assert (said.minutes, arena_of(said.arena)) == (3.0, arena)
    assert pose_of(said.start) == pytest.approx((0.1, -0.2, math.pi / 2))
    assert speeds_of(said.speeds) == (-0.2, 0.15)
    assert limits_in_words(None, None, None, None) == {"area": "", "limits": ""}


def test_an_experiment_planned_in_python_says_its_limits_again():
    diagnosis = SimpleNamespace(command={"data": "log.csv", "model": "--model khepera", "search": "--model khepera"})
    proposal = SimpleNamespace(
        verdict="tie", competing_models=(), model_pairs=(), minutes=3.0, plan=range(1), bounds=SimpleNamespace(robot="khepera"),
        arena=SimpleNamespace(start=(0.5, 0.2, 0.0)),
    )  # fmt: skip
    limits = limits_in_words(3, (1.8, 1.3), None, (-0.2, 0.2))
    result = ProposeResult(diagnosis, proposal, limits)
    again = next(_next(proposal, "next.csv", result.command))
    assert again.endswith(
        "bns propose log.csv --model khepera --minutes 3 --arena 1.8x1.3 --speeds=-0.2,0.2 --start=0,0,90 -o next.csv"
    )


def test_a_wheelbase_is_written_where_the_name_means_another():
    assert model_words(bns.Model("khepera"))["wheelbase_m"] is None
    assert model_words(bns.Model("khepera", wheelbase_m=0.2)) == {"model": "khepera", "wheelbase_m": 0.2}
    assert repeated("a.csv", **model_words(bns.Model(wheelbase_m=0.2)))["model"] == "--model differential-drive --wheelbase 0.2"


def flags_outside(tree):
    """Texts of raised errors with an option of the command line that is not beside its name in Python."""
    within = {id(one) for call in ast.walk(tree) if getattr(getattr(call, "func", None), "id", "") == "in_both"
              for one in ast.walk(call)}  # fmt: skip
    texts = (one for fault in ast.walk(tree) if isinstance(fault, ast.Raise) for one in ast.walk(fault))
    return [one.value for one in texts if isinstance(one, ast.Constant) and id(one) not in within and FLAG.search(str(one.value))]


FLAG = re.compile(r"(^|[\s(])--[a-z]")
ON_THE_COMMAND_LINE_ALONE = {"import_log.py", "network_errors.py", "trial.py", "run.py"}
"""Messages of `bns import`, of writing networks, and of runs and trials."""


def test_errors_that_python_meets_name_its_arguments_beside_the_options():
    folder = Path(bns.__file__).parent
    modules = [path for room in ("api", "diagnose") for path in (folder / room).rglob("*.py")]
    found = {path.name: flags_outside(ast.parse(path.read_text())) for path in modules}
    assert {name: texts for name, texts in found.items() if texts and name not in ON_THE_COMMAND_LINE_ALONE} == {}
    assert flags_outside(ast.parse("raise DataError(f'{x}; give --model snake')")) == ["; give --model snake"]
    assert flags_outside(ast.parse("raise DataError(f\"give {in_both('--model snake', 'x')}\")")) == []


def test_a_model_of_another_robot_is_refused_with_both_ways_to_give_one(tmp_path):
    write_measurements(measured(NOMINAL, trials=4), tmp_path / "log.csv")
    said = r"--model khepera, or --model differential-drive --wheelbase METRES \(in Python: the model \"khepera\", or bns\.Model"
    with pytest.raises(DataError, match=said):
        prepared(tmp_path / "log.csv", "snake")
    with pytest.raises(DataError, match=r"--wheelbase 0\.08\d* \(in Python: bns\.Model\(NAME, wheelbase_m=0\.08\d*\)\)"):
        prepared(tmp_path / "log.csv", bns.Model(wheelbase_m=0.35))
