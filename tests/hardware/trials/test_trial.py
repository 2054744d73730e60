"""Whole trials on the emulated Khepera, from command to table."""

import io
import itertools
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import nullcontext
from datetime import datetime, timedelta
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from bns.console import view
from bns.hardware.link.hardware_log import events
from bns.trial.folder import past_evaluations
from bns.trial.table_lines import moving_away

from .. import soak
from .calls import TRIAL, call, evaluated, faults, journal_of


class SetBack(datetime):
    """The time of day, set back by two hours while a trial goes on."""

    asked = 0

    @classmethod
    def now(cls, tz=None):
        cls.asked += 1
        return datetime.now(tz) - timedelta(hours=2 * (cls.asked > 1))


def test_from_command_to_table_and_replay(tmp_path, capsys, monkeypatch):
    with monkeypatch.context() as patched:
        patched.setattr("bns.trial.session.datetime", SetBack)
        assert call(*TRIAL, "--evaluations", 3, "--results", tmp_path) == 0
    said = capsys.readouterr().out
    assert re.search(r", \d+ s by the wall clock", said)
    assert "3 evaluations" in said
    assert "stops: 3 confirmed" in said
    assert "the robot waited for computations" in said
    rows = evaluated(tmp_path, "trials-emulated")
    assert rows["evaluation"].tolist() == [1, 2, 3]
    assert set(rows["world"]) == {"robot"}
    assert (rows["fitness_world"] == rows["evaluated_fitness_world"]).all()
    journal = journal_of(tmp_path)
    assert (journal.parent / "path.png").exists()

    assert call("trial", "--replay", journal, "--results", tmp_path) == 0
    again = evaluated(tmp_path, "trials-replayed")
    same = [c for c in rows.columns if c not in {"run_id", "sweep"} and not c.endswith("_s")]
    pd.testing.assert_frame_equal(rows[same], again[same])


def test_measurements_are_one_table_of_commands_and_poses(tmp_path):
    assert call(*TRIAL, "--evaluations", 2, "--results", tmp_path) == 0
    journal = journal_of(tmp_path)
    table = pd.read_csv(journal.parent / "measurements.csv")
    assert {"trial", "t_s", "left_m_s", "right_m_s", "x_m", "y_m", "heading_rad", "session_s", "battery_v"} <= set(table)
    for _, drive in table.groupby("trial"):
        assert (drive["t_s"].diff().dropna() > 0).all()
        assert drive["t_s"].iloc[0] == 0
        assert drive["left_m_s"].iloc[:-1].between(0.0, 0.21).all()
        assert np.isnan(drive["left_m_s"].iloc[-1])
        assert drive["heading_rad"].diff().abs().max() < 0.6
    kinds = {e["kind"] for e in events(journal)}
    assert {"trial", "sent", "received", "seen", "command", "driven", "evaluated", "stop", "complete"} <= kinds


def test_what_was_driven_is_what_was_asked_but_for_rounding(tmp_path):
    assert call(*TRIAL, "--evaluations", 2, "--results", tmp_path) == 0
    for done in past_evaluations(journal_of(tmp_path)):
        count = len(done.commands)
        assert count
        assert len(done.poses) == count + 1
        np.testing.assert_allclose(done.commands[:, :2], done.picked[:count, :2], atol=1.0)
        np.testing.assert_allclose(done.commands[:, 2], done.picked[:count, 2], atol=35.0)


def test_a_pause_is_gone_on_with_and_nothing_is_lost(tmp_path, capsys):
    plan = faults(tmp_path, {"kind": "hang-up", "at_s": 12, "for_s": 2})
    asked = [*TRIAL, "--evaluations", 4, "--results", tmp_path]
    assert call(*asked, *plan) == 3
    said = capsys.readouterr().err
    assert "the robot was lost" in said
    assert "planned faults that happened: hang-up at 12 s" in said
    before = past_evaluations(journal_of(tmp_path))
    assert 1 <= len(before) < 4
    assert (journal_of(tmp_path).parent / "measurements.csv").exists()
    assert call(*asked) == 2
    assert "Continue it with --resume" in capsys.readouterr().err
    assert call(*asked, "--resume") == 0
    after = past_evaluations(journal_of(tmp_path))
    assert len(after) == 4
    for old, new in zip(before, after, strict=False):
        np.testing.assert_array_equal(old.poses, new.poses)
    assert evaluated(tmp_path, "trials-emulated")["evaluation"].tolist() == [1, 2, 3, 4]


def test_a_resumed_trial_is_the_trial_that_a_replay_gives(tmp_path, capsys):
    asked, journal = paused(tmp_path)
    kept = journal.read_bytes()
    journal.write_bytes(b"")
    assert call(*asked, "--resume") == 2
    assert "has lost its last lines, or was cut: it holds 0 rows" in capsys.readouterr().err
    journal.write_bytes(kept)
    assert call(*asked, "--resume") == 0
    assert call("trial", "--replay", journal_of(tmp_path), "--results", tmp_path) == 0
    first, again = evaluated(tmp_path, "trials-emulated"), evaluated(tmp_path, "trials-replayed")
    np.testing.assert_array_equal(first["best_fitness"], again["best_fitness"])
    assert len(first) == 3


def paused(tmp_path):
    """What was asked, and the journal of a trial that was interrupted after some drives."""
    asked = [*TRIAL, "--evaluations", 3, "--results", tmp_path, "--most-rounds", 3]
    for name, data in _paused_files().items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(data)
    return asked, journal_of(tmp_path)


@cache
def _paused_files():
    """What such a trial leaves, by path: it is driven once, and every test begins with a copy."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        plan = faults(place, {"kind": "hang-up", "at_s": 12, "for_s": 2})
        assert call(*TRIAL, "--evaluations", 3, "--results", place, "--most-rounds", 3, *plan) == 3
        return {path.relative_to(place): path.read_bytes() for path in place.rglob("*") if path.is_file()}


def test_measurements_whose_journal_is_gone_are_not_written_over(tmp_path, capsys):
    asked, journal = paused(tmp_path)
    table = journal.with_name("measurements.csv")
    kept = table.read_bytes()
    journal.unlink()
    for way in ([], ["--resume"]):
        assert call(*asked, *way) == 2
        said = capsys.readouterr().err
        assert f"{table} is there, and journal.jsonl, from which it was made, is gone" in said
        assert f"move the folder {journal.parent} away" in said
        assert table.read_bytes() == kept
    compare = re.search(r"bns (compare \S+ \S+ \S+csv)", said)[1].replace(" MODEL ", " khepera ")
    assert call(*compare.split()) == 0
    journal.parent.rename(tmp_path / "away")
    assert call(*asked) == 0


@pytest.mark.filterwarnings("default::bns.hardware.link.sealed_lines.LogWarning")
def test_the_advice_on_a_damaged_journal_works(tmp_path, capsys):
    """Word by word: what is said after each attempt is done in a shell."""
    asked, journal = paused(tmp_path)
    table, lines = journal.with_name("measurements.csv"), journal.read_bytes().splitlines(keepends=True)
    spoilt = max(n for n, line in enumerate(lines) if b'"kind":"driven"' in line)
    lines[spoilt] = lines[spoilt].replace(b"driven", b"Driven", 1)
    journal.write_bytes(b"".join(lines))
    assert call(*asked, "--resume") == 2
    said = capsys.readouterr().err
    assert "once the measurements.csv beside it is moved away" in said
    command = re.search(r"head -n \d+ \S+ > FILE", said)[0]
    subprocess.run(["bash", "-c", f"{command} && mv FILE {journal}"], cwd=tmp_path, check=True)
    assert call(*asked, "--resume") == 2
    said = capsys.readouterr().err
    assert "has lost its last lines, or was cut" in said
    subprocess.run(re.search(r"mv \S+ \S+", said)[0].split(), check=True)
    assert call(*asked, "--resume") == 0
    assert "so nothing shows whether journal.jsonl has lost lines at its end" in capsys.readouterr().err
    assert table.exists()
    assert len(past_evaluations(journal)) == 3


@pytest.mark.filterwarnings("default::bns.hardware.link.sealed_lines.LogWarning")
def test_a_line_of_the_table_that_is_none_is_named_and_the_journal_is_not_blamed(tmp_path, capsys):
    asked, journal = paused(tmp_path)
    table = journal.with_name("measurements.csv")
    rows = table.read_bytes().count(b"\n")
    table.write_bytes(table.read_bytes() + b"garbage\n")
    assert call(*asked, "--resume") == 2
    said = capsys.readouterr().err
    assert f"line {rows + 1} of {table} is no row of measurements" in said
    assert "lost its last lines" not in said
    subprocess.run(re.search(r"mv \S+ \S+", said)[0].split(), check=True)
    assert call(*asked, "--resume") == 0
    assert "so nothing shows whether journal.jsonl has lost lines at its end" in capsys.readouterr().err


@pytest.mark.parametrize("way", [[], ["--resume"]])
def test_repeats_whose_journal_is_gone_are_not_written_over(tmp_path, capsys, way):
    asked, journal = paused(tmp_path)
    journal.with_name("measurements.csv").unlink()
    journal.rename(journal.with_name("repeats.csv"))
    assert call(*asked, *way) == 2
    said = capsys.readouterr().err
    assert f"{journal.with_name('repeats.csv')} is there, and journal.jsonl, from which it was made, is gone" in said
    assert "bns compare" not in said


def end_doubled(lines):
    return [*lines, lines[-1]]


def words_in_cells(lines):
    return [*lines, ",".join(["garbage"] * len(lines[0].split(",")))]


def middle_doubled(lines):
    return [*lines[:9], *lines[8:]]


def row_taken_out(lines):
    return [*lines[:9], *lines[10:]]


def names_changed(lines):
    return [lines[0].replace("t_s", "time", 1), *lines[1:]]


@pytest.mark.filterwarnings("default::bns.hardware.link.sealed_lines.LogWarning")
@pytest.mark.parametrize(
    ("change", "line"),
    [(end_doubled, -1), (words_in_cells, -1), (middle_doubled, 10), (row_taken_out, 10), (names_changed, 1)],
)
def test_a_table_that_is_not_the_journal_s_is_moved_away_as_advised(tmp_path, capsys, change, line):
    asked, journal = paused(tmp_path)
    table = journal.with_name("measurements.csv")
    lines = change(table.read_text().splitlines())
    table.write_text("".join(f"{one}\n" for one in lines))
    assert call(*asked, "--resume") == 2
    said = capsys.readouterr().err
    assert f"line {line if line > 0 else len(lines)} of {table} is no row of measurements of this trial" in said
    assert "lost its last lines" not in said
    subprocess.run(re.search(r"mv \S+ \S+", said)[0].split(), check=True)
    assert call(*asked, "--resume") == 0
    assert "so nothing shows whether journal.jsonl has lost lines at its end" in capsys.readouterr().err
    assert pd.read_csv(table)["t_s"].notna().all()


def test_lines_lost_from_a_journal_are_said_also_below_a_table_with_garbage(tmp_path, capsys):
    asked, journal = paused(tmp_path)
    table = journal.with_name("measurements.csv")
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:3]))
    table.write_bytes(table.read_bytes() + b"garbage\n")
    assert call(*asked, "--resume") == 2
    said = capsys.readouterr().err
    assert "has lost its last lines, or was cut: it holds 0 rows" in said
    assert "what was measured after row 0 is in that table alone" in said


def test_a_table_is_moved_to_a_name_that_is_free(tmp_path):
    table = tmp_path / "a trial" / "measurements.csv"
    table.parent.mkdir()
    for text in ("first", "second", "third"):
        table.write_text(text)
        subprocess.run(["bash", "-c", moving_away(table)], check=True)
    assert sorted(path.read_text() for path in table.parent.iterdir()) == ["first", "second", "third"]


def test_the_summary_lists_which_planned_faults_happened(tmp_path, capsys):
    plan = faults(
        tmp_path,
        {"kind": "late-tracker", "at_s": 1, "for_s": 0.01},
        {"kind": "lost-reply", "at_s": 2},
        {"kind": "hang-up", "at_s": 10_000, "for_s": 1},
        {"kind": "overheat", "at_s": 1, "id": 3},
    )
    assert call(*TRIAL, "--evaluations", 1, "--results", tmp_path, *plan) == 0
    said = capsys.readouterr().out
    assert "\n1 evaluation, " in said
    happened = "planned faults that happened: late-tracker at 1 s, lost-reply at 2 s; "
    assert f"{happened}that did not happen: hang-up at 10000 s, overheat of servo 3 at 1 s" in said
    assert call(*TRIAL, "--evaluations", 1, "--seed", 9, "--results", tmp_path) == 0
    assert "planned faults" not in capsys.readouterr().out


def test_a_stop_that_cannot_be_confirmed_is_shouted(tmp_path, capsys):
    plan = faults(tmp_path, {"kind": "hang-up", "at_s": 5, "for_s": 10_000})
    assert call(*TRIAL, "--evaluations", 3, "--results", tmp_path, *plan) == 4
    said = capsys.readouterr().err
    assert "THE ROBOT MAY STILL BE MOVING: CUT THE POWER NOW" in said
    assert "is gone" in said
    *_, last = events(journal_of(tmp_path), "stop")
    assert not last["confirmed"]


def test_leaving_the_surface_ends_the_drive_not_the_trial(tmp_path, capsys):
    rig = tmp_path / "rig.yaml"
    text = "robot: khepera\nport: x\nsurface_m: {x: [-0.3, 0.3], y: [-0.3, 0.3]}\n"
    rig.write_text(text + "tracker: {kind: wii, device: x, height_m: 2.4, view_rad: 0.75}\n")
    assert call(*TRIAL, "--evaluations", 4, "--results", tmp_path, "--rig", rig) == 0
    assert "left the surface" in capsys.readouterr().out
    driven = list(events(journal_of(tmp_path), "driven"))
    assert any("left the surface" in e["ended"] for e in driven)
    assert all(e["confirmed"] for e in events(journal_of(tmp_path), "stop"))


def test_a_robot_out_of_sight_is_stopped_soon(tmp_path):
    plan = faults(tmp_path, {"kind": "lost-marker", "at_s": 6, "for_s": 3})
    call(*TRIAL, "--evaluations", 2, "--results", tmp_path, *plan)
    found = list(events(journal_of(tmp_path), "seen", "stop"))
    seen = [e["t_s"] for e in found if e["kind"] == "seen"]
    gap_s = next(b for a, b in itertools.pairwise(seen) if b - a > 0.4)
    stop = next(e for e in found if e["kind"] == "stop" and 6 < e["t_s"] < gap_s)
    assert stop["confirmed"]
    assert stop["t_s"] - 6 < 0.5 + 0.2 + 0.45


@pytest.mark.parametrize(
    ("number", "word"),
    [(signal.SIGINT, "interrupted"), pytest.param(signal.SIGTERM, "terminated", marks=pytest.mark.slow)],
)
def test_signals_stop_the_robot_first(tmp_path, number, word):
    asked = [str(a) for a in (*TRIAL, "--evaluations", 50, "--results", tmp_path)]
    asked[asked.index("inf")] = "30"
    process = subprocess.Popen(
        [sys.executable, "-m", "bns", *asked], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ
    )
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        found = list((tmp_path / "trials").glob("*/journal.jsonl"))
        if found and '"kind":"evaluated"' in found[0].read_text():
            break
        time.sleep(0.1)
    process.send_signal(number)
    _, said = process.communicate(timeout=600)
    assert process.returncode == 3, said
    assert word in said
    assert "the same command with --resume goes on" in said
    assert "Traceback" not in said
    *_, last = events(journal_of(tmp_path), "stop")
    assert last["confirmed"]
    assert past_evaluations(journal_of(tmp_path))


def test_a_torn_last_line_is_passed_over(tmp_path):
    assert call(*TRIAL, "--evaluations", 1, "--results", tmp_path) == 0
    journal = journal_of(tmp_path)
    whole = len(list(events(journal)))
    with journal.open("a") as file:
        file.write('{"t_s": 3.0, "ki')
    assert len(list(events(journal))) == whole
    assert call(*TRIAL, "--evaluations", 1, "--results", tmp_path, "--resume") == 0


@pytest.mark.slow
def test_ten_trials_with_faults_at_random(tmp_path):
    ends = [soak.judged(seed, tmp_path) for seed in range(10)]
    assert set(ends) <= {"done", "paused, resumed", "stop not confirmed, and shouted", "refused before it moved"}
    assert ends.count("done") >= 2


def test_the_live_view_shows_robot_and_rig(tmp_path, monkeypatch):
    console, seen = Console(width=200, record=True, file=io.StringIO()), []

    def watching(spec, more, _now):
        return nullcontext(lambda row: seen.append((spec, row, more())))

    monkeypatch.setattr("bns.trial.session.live_view", watching)
    assert call(*TRIAL, "--evaluations", 1, "--results", tmp_path) == 0
    console.print(view(*seen[0]))
    shown = console.export_text()
    for heading in ("7 cm", "20 cm", "battery", "last stop", "ended early"):
        assert heading in shown
    assert re.search(r"7\.9 V", shown)
    assert re.search(r"\d+ ms", shown)
    assert "unstable" not in shown


def test_a_trial_can_end_with_success(tmp_path, monkeypatch, capsys):
    worth = iter([False, True, False, True, True, True])
    monkeypatch.setattr("bns.bootstrap.recorder.Recorder.add_evaluated", _succeeding(worth))
    assert call(*TRIAL, "--evaluations", 9, "--until-success", 2, "--results", tmp_path) == 0
    assert "5 evaluations" in capsys.readouterr().out
    assert evaluated(tmp_path, "trials-emulated")["evaluated_success"].tolist() == [False, True, False, True, True]


def _succeeding(worth):
    from bns.bootstrap.recorder import Recorder

    real = Recorder.add_evaluated

    def add(self, *arguments):
        real(self, *arguments)
        self._evaluated["evaluated_success"] = next(worth)

    return add
