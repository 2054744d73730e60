"""The operator: asked before the first drive, shown what goes on, and what is discarded counts for nothing."""

import io
import re
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

import bns
from bns.cli.main import main
from bns.console import LiveView, live_view
from bns.errors import DataError, TrialPausedError
from bns.hardware.link.hardware_log import events
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping
from bns.trial import session
from bns.trial.driver import TrialDriver
from bns.trial.folder import measured, past_evaluations
from bns.trial.operator import TerminalOperator, UnattendedOperator
from bns.trial.session import TrialSetup, open_rig

from .. import soak

START = np.array([0.0, 0.0, np.pi / 2])
COMMANDS = np.array([[12000, 9000, 900], [8000, 14000, 900]], np.float32)
TRIAL = ["trial", "--robot", "khepera", "--emulated", "--speed", "inf", "--no-figures", *soak.QUICK]


class Person(TerminalOperator):
    """Somebody who answers from a list, and puts the emulated robot back."""

    def __init__(self, hands, answers):
        self.asked, self._answers, self._hands = [], iter(answers), hands
        super().__init__(self._next, sleep=lambda _s: None)

    def _next(self, question):
        self.asked.append(question)
        answer = next(self._answers)
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def place(self, start, why):
        self._hands.place(start, why)


@pytest.fixture
def trial(tmp_path):
    """trial(answers) -> driver, person and journal on an emulated rig."""
    opened = []

    def build(answers):
        journal = tmp_path / "journal.jsonl"
        how = TrialSetup(shipped_rig("khepera"), emulated=True, speed=np.inf)
        stopping = Stopping()
        manager = open_rig(how, 0, journal, stopping)
        rig = manager.__enter__()
        opened.append(manager)
        person = Person(rig.operator, answers)
        goals = np.array([[0.2, 0.2], [-0.1, 0.3]])
        picture = tmp_path / "last-drive.png"
        driver = TrialDriver(rig.platform, person, how.rig, START, rig.clock, rig.log, picture, goals)
        return SimpleNamespace(driver=driver, person=person, journal=journal, log=rig.log, picture=picture)

    yield build
    for manager in opened:
        manager.__exit__(None, None, None)


def kinds(on, *names):
    on.log.sync()
    return [(e["kind"], e.get("why")) for e in events(on.journal, *names)]


def test_arming_asks_before_the_first_drive_and_only_then(trial, capsys):
    on = trial(["", "", ""])
    on.driver.evaluate(1, COMMANDS)
    on.driver.evaluate(2, COMMANDS)
    assert len(on.person.asked) == 3
    assert "evaluation 1: the robot will drive 2 commands in about 2 s, x -0.9 to 0.9 m" in on.person.asked[0]
    assert [line for line in capsys.readouterr().err.splitlines() if "drives in" in line] == [
        f"the robot drives in {n}" for n in (3, 2, 1)
    ]


def test_who_does_not_want_it_armed_has_a_robot_that_has_not_moved(trial):
    on = trial(["p"])
    with pytest.raises(TrialPausedError, match="paused by the operator"):
        on.driver.evaluate(1, COMMANDS)
    assert not kinds(on, "command")


def test_a_signal_ends_the_countdown(trial):
    def asked_to_stop():
        raise TrialPausedError("interrupted")

    counted = []
    with pytest.raises(TrialPausedError, match="interrupted"):
        UnattendedOperator(asked_to_stop, counted.append).arm("it drives")
    assert counted == [1.0]


def test_cycles_that_are_not_there_are_asked_for_again(capsys):
    answers = iter(["u", "0 2", "2 3", "none", "2, 1"])
    decided = TerminalOperator(lambda _question: next(answers)).accept("driven", [(0.0, 1.0), (1.0, 2.0)])
    assert decided == ("next", (1, 2))
    assert capsys.readouterr().err.count("names no cycle, or one that is not there: write numbers from 1 to 2") == 3


def test_what_is_driven_again_is_discarded_first(trial):
    on = trial(["", "r", ""])
    kept = on.driver.evaluate(1, COMMANDS)
    assert not kept.skipped
    assert kinds(on, "driven", "discarded") == [("driven", None), ("discarded", "repeat"), ("driven", None)]
    assert measured(on.journal).groupby("trial")["discarded"].first().tolist() == [1, 0]


def test_what_was_unstable_the_time_before_is_not_so_again(trial):
    on = trial([])
    for marks in ([2], [1], []):
        on.log.note("driven", evaluation=1, picked=COMMANDS.tolist(), commands=COMMANDS.tolist(), poses=np.zeros((3, 3)).tolist())
        if marks:
            on.log.note("marked", evaluation=1, unstable=marks)
        on.log.sync()
        assert past_evaluations(on.journal)[0].unstable == tuple(marks)


def test_skip_skips(trial):
    on = trial(["", "s"])
    passed = on.driver.evaluate(1, COMMANDS)
    assert passed.skipped
    assert not len(passed.commands)
    assert kinds(on, "driven", "discarded") == [("driven", None), ("discarded", "skip")]
    on.driver.skipped(1, COMMANDS, 3)
    on.log.sync()
    [past] = past_evaluations(on.journal)
    assert (past.skipped, past.rounds) == (True, 3)
    np.testing.assert_array_equal(past.picked, COMMANDS)


@pytest.mark.parametrize("answer", ["p", KeyboardInterrupt(), EOFError()])
def test_a_pause_at_the_question_discards_what_was_driven(trial, answer):
    on = trial(["", answer])
    with pytest.raises(TrialPausedError, match="paused by the operator"):
        on.driver.evaluate(1, COMMANDS)
    assert kinds(on, "driven", "discarded") == [("driven", None), ("discarded", "paused")]
    assert past_evaluations(on.journal) == []
    assert measured(on.journal)["discarded"].unique().tolist() == [1]


def test_a_real_robot_does_not_drive_where_nobody_can_answer(trial, monkeypatch):
    on = trial([])
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    on.driver._operator = session._somebody(TrialSetup(shipped_rig("khepera")), Stopping())
    with pytest.raises(TrialPausedError, match=r"whose input has ended \(with --yes, nobody is asked\)"):
        on.driver.evaluate(1, COMMANDS)
    assert kinds(on, "driven", "command") == []


def test_the_question_comes_with_the_picture_of_what_was_driven(trial):
    on = trial(["", ""])
    on.driver.evaluate(1, COMMANDS)
    question = on.person.asked[1]
    assert on.picture.stat().st_size > 1000
    assert str(on.picture) in question
    drawn = question.split("(as a picture")[0]
    assert drawn.count("o") == 1
    assert drawn.count("@") == 1
    assert drawn.count("x") == 2
    assert "·" in drawn


def test_the_screen_follows_while_it_moves(trial):
    on, shown = trial(["", ""]), []
    on.log.listeners.append(lambda kind, _what: shown.append(on.driver.underway.text()) if kind == "seen" else None)
    on.driver.evaluate(1, COMMANDS)
    assert on.driver.underway.text() == ""
    moving = [text for text in shown if "command" in text]
    assert re.match(r"command 0 of 2 · 2 s left · x [+-]0.00 m, y [+-]0.00 m, heading (90|89|91)°", moving[0])
    assert "battery 7.9 V" in moving[0]
    last = moving[-1].splitlines()[0]
    assert "command 2 of 2 · 0 s left" in last
    assert float(last.split(" m driven")[0].rsplit(" ", 1)[1]) == pytest.approx(0.13, abs=0.04)


def test_a_live_view_shows_what_goes_on_and_leaves_questions_alone():
    console = Console(file=io.StringIO(), force_terminal=True, width=80)
    shown = LiveView(None, dict, lambda: "command 1 of 2")
    console.print(shown.picture())
    assert "command 1 of 2" in console.file.getvalue()
    with shown.suspended():
        pass
    with live_view(None, now=lambda: "never") as quiet, quiet.suspended():
        assert quiet.live is None


def scripted(monkeypatch, answers):
    """Trials of the command line with a person at the terminal instead of the emulated hands."""
    given = iter(answers)
    real = session.EmulatedHands
    monkeypatch.setattr(session, "EmulatedHands", lambda emulation, seed: Person(real(emulation, seed), given))


def call(*arguments):
    return main([str(a) for a in arguments])


def test_a_skipped_evaluation_has_no_row_and_a_resumed_trial_is_the_same(tmp_path, monkeypatch):
    asked = [*TRIAL, "--evaluations", 4, "--most-rounds", 2, "--results", tmp_path]
    scripted(monkeypatch, ["", "", "s", "", "p"])
    assert call(*asked) == 3
    scripted(monkeypatch, ["", ""])
    assert call(*asked, "--resume") == 0
    rows = bns.load(tmp_path)
    assert rows["evaluation"].tolist() == [1, 3, 4]
    [journal] = (tmp_path / "trials").glob("*/journal.jsonl")
    assert [e.skipped for e in past_evaluations(journal)] == [False, True, False, False]
    table = pd.read_csv(journal.with_name("measurements.csv"))
    assert table.groupby("trial")["discarded"].first().tolist() == [0, 1, 0, 1, 0]
    assert call("trial", "--replay", journal, "--results", tmp_path) == 0
    again = bns.load(tmp_path)
    again = again[again["sweep"] == "trials-replayed"]
    np.testing.assert_array_equal(again["best_fitness"], rows["best_fitness"])


def test_a_trial_of_which_everything_was_skipped_keeps_nothing(tmp_path, monkeypatch, capsys):
    scripted(monkeypatch, ["", "s", "s"])
    assert call(*TRIAL, "--evaluations", 2, "--most-rounds", 1, "--results", tmp_path) == 3
    assert "all 2 evaluations were skipped" in capsys.readouterr().err


def test_given_commands_are_skipped_one_by_one(tmp_path, monkeypatch, capsys):
    file = tmp_path / "three.csv"
    file.write_text("trial,left_m_s,right_m_s,duration_s\n" + "".join(f"{n},0.1,0.08,0.8\n" for n in (1, 2, 3)))
    scripted(monkeypatch, ["", "", "s", ""])
    asked = ["trial", "--robot", "khepera", "--emulated", "--speed", "inf", "--results", tmp_path, "--commands", file]
    assert call(*asked) == 0
    table = pd.read_csv(tmp_path / "trials" / "experiment-three-emulated" / "measurements.csv")
    assert table.groupby("trial")["discarded"].first().tolist() == [0, 1, 0]


def test_discarded_drives_feed_no_diagnosis(tmp_path):
    given = bns.Measurements("bns/examples/files/khepera-log.csv").frame
    names = given["trial"].unique()
    given["discarded"] = given["trial"].isin(names[:3]).astype(int)
    kept = bns.Measurements(given)
    assert sorted(kept.frame["trial"].unique()) == sorted(names[3:])
    given["discarded"] = 1
    with pytest.raises(DataError, match="All drives are marked as discarded"):
        bns.Measurements(given)


def test_rounds_belong_to_the_drive_that_they_were_noted_with(trial):
    on = trial([])
    for _ in range(2):
        on.log.note("driven", evaluation=1, picked=COMMANDS.tolist(), commands=COMMANDS.tolist(), poses=np.zeros((3, 3)).tolist())
        on.log.sync()
        assert past_evaluations(on.journal)[0].rounds is None
        on.log.note("evaluated", evaluation=1, rounds=7)
        on.log.sync()
        assert past_evaluations(on.journal)[0].rounds == 7


def test_a_cycle_that_was_called_unstable_marks_the_rows_that_it_led_to(trial):
    on = trial([])
    rows = [{"t_s": float(n), "cycle": cycle, "stable": 1.0} for n, cycle in enumerate((1.0, 1.0, 2.0, 2.0, None))]
    on.log.note("driven", evaluation=1, rows=rows, session_s=3.0, readings={})
    on.log.note("marked", evaluation=1, unstable=[2])
    on.log.sync()
    table = measured(on.journal)
    assert table["stable"].tolist() == [1.0, 1.0, 1.0, 0.0, 0.0]
    assert table["session_s"].tolist() == [3.0, 4.0, 5.0, 6.0, 7.0]
