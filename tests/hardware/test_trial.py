"""Whole trials on the emulated Khepera, from command to table."""

import io
import itertools
import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import nullcontext

import numpy as np
import pandas as pd
import pytest
import yaml
from rich.console import Console

import bns
from bns.cli.main import main
from bns.console import view
from bns.hardware.link.hardware_log import events
from bns.trial.folder import past_evaluations

from . import soak

TRIAL = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", *soak.QUICK]


def journal_of(results):
    [journal] = (results / "trials").glob("*/journal.jsonl")
    return journal


def faults(tmp_path, *plan):
    file = tmp_path / "faults.yaml"
    file.write_text(yaml.safe_dump({"seed": 1, "faults": list(plan)}))
    return ["--faults", file]


def call(*arguments):
    return main([str(a) for a in arguments])


def evaluated(results, sweep):
    rows = bns.load(results)
    return rows[rows["sweep"] == sweep].reset_index(drop=True)


def test_from_command_to_table_and_replay(tmp_path, capsys):
    assert call(*TRIAL, "--evaluations", 3, "--results", tmp_path) == 0
    said = capsys.readouterr().out
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
    assert "the robot was lost" in capsys.readouterr().err
    before = past_evaluations(journal_of(tmp_path))
    assert 1 <= len(before) < 4
    assert (journal_of(tmp_path).parent / "measurements.csv").exists()
    assert call(*asked) == 2
    assert "Go on with --resume" in capsys.readouterr().err
    assert call(*asked, "--resume") == 0
    after = past_evaluations(journal_of(tmp_path))
    assert len(after) == 4
    for old, new in zip(before, after, strict=False):
        np.testing.assert_array_equal(old.poses, new.poses)
    assert evaluated(tmp_path, "trials-emulated")["evaluation"].tolist() == [1, 2, 3, 4]


def test_a_resumed_trial_is_the_trial_that_a_replay_gives(tmp_path):
    plan = faults(tmp_path, {"kind": "hang-up", "at_s": 12, "for_s": 2})
    asked = [*TRIAL, "--evaluations", 3, "--results", tmp_path, "--most-rounds", 3]
    assert call(*asked, *plan) == 3
    assert call(*asked, "--resume") == 0
    assert call("trial", "--replay", journal_of(tmp_path), "--results", tmp_path) == 0
    first, again = evaluated(tmp_path, "trials-emulated"), evaluated(tmp_path, "trials-replayed")
    np.testing.assert_array_equal(first["best_fitness"], again["best_fitness"])
    assert len(first) == 3


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


@pytest.mark.parametrize(("number", "word"), [(signal.SIGINT, "interrupted"), (signal.SIGTERM, "terminated")])
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
    _, said = process.communicate(timeout=60)
    assert process.returncode == 3, said
    assert word in said
    assert "Traceback" not in said
    *_, last = events(journal_of(tmp_path), "stop")
    assert last["confirmed"]
    assert past_evaluations(journal_of(tmp_path))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--robot", "khepera"], "a real robot needs --rig FILE"),
        (["--robot", "khepera", "--emulated", "--speed", "0"], "--speed is 0; it must be above 0"),
        (["--robot", "khepera", "--rig", "none.yaml"], "cannot read the rig none.yaml"),
        (["--robot", "khepera", "--emulated", "--resume"], "nothing to resume"),
        (["--robot", "kepera", "--emulated"], "unknown robot 'kepera'. Did you mean 'khepera'"),
        (["--replay", "none.jsonl"], "cannot read the journal none.jsonl"),
        (["--robot", "khepera", "--rig", "r.yaml", "--faults", "f.yaml"], "--faults is for --emulated"),
        (["--robot", "khepera", "--emulated", "--results", "/proc/none"], "cannot use /proc/none: No such file or directory"),
    ],
)
def test_bad_input_is_named(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert call("trial", *arguments) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"surface_m": {"x": [-0.1, 0.1], "y": [-0.1, 0.1]}}, r"goal at \(0.20, 0.20\) m, off the surface"),
        ({"surface_m": {"x": [0.1, -0.1], "y": [0, 1]}}, "must be the smaller one"),
        ({"surface_m": 3}, "surface_m is 3; write"),
        ({"robot": "snake"}, "is a rig for snake, and the trial is for khepera"),
        ({"prot": 1}, "unknown key 'prot'. Did you mean 'port'"),
        ({"tracker": {}}, "it needs a kind"),
        ({"lost_s": -1}, "lost_s is -1; it must be a number above 0"),
        ({"port": "/dev/nowhere"}, "there is no port /dev/nowhere"),
    ],
)
def test_bad_rigs_are_named_before_anything_moves(tmp_path, capsys, change, message):
    rig = {"robot": "khepera", "port": "/dev/nowhere", "surface_m": {"x": [-1, 1], "y": [-1, 1]}}
    rig |= {"tracker": {"kind": "wii", "device": "x", "height_m": 2.0, "view_rad": 0.7}} | change
    file = tmp_path / "rig.yaml"
    file.write_text(yaml.safe_dump(rig))
    assert call("trial", "--robot", "khepera", "--rig", file, "--yes", "--results", tmp_path / "r") == 2
    assert re.search(message, capsys.readouterr().err)
    assert not list((tmp_path / "r").rglob("journal.jsonl"))


WII = {"kind": "wii", "device": "x", "height_m": 2.4, "view_rad": 0.75}
COLOUR = {"kind": "colour", "camera": 0, "calibration": "none.json", "diameter_m": 0.04, "height_m": 0.07}


@pytest.mark.parametrize(
    ("robot", "tracker", "message"),
    [
        ("khepera", {"kind": "radar"}, "unknown kind of tracker 'radar'"),
        ("khepera", WII | {"height_m": -1}, "height_m is -1; it must be a number above 0"),
        ("khepera", WII | {"x_m": "left"}, "has a setting that is no number"),
        ("khepera", {"kind": "colour"}, "lacks camera, calibration, diameter_m, height_m"),
        ("khepera", COLOUR | {"diameter_m": "abc"}, "diameter_m is 'abc'; it must be a number above 0"),
        ("khepera", COLOUR | {"yellow": [20, 90]}, "marker colours are too close"),
        ("khepera", COLOUR | {"yellow": [90, 20]}, r"yellow is \[90, 20\]; write two hues"),
        ("khepera", {**COLOUR, "kind": "aruco"}, "lacks side_m"),
        ("snake", WII, "told apart by colour; its tracker is wii"),
        ("snake", COLOUR | {"height_m": 0}, "height_m is 0; it must be a number above 0"),
    ],
)
def test_trackers_that_make_no_sense_are_named_by_the_emulated_rig_too(tmp_path, capsys, robot, tracker, message):
    file = tmp_path / "rig.yaml"
    surface = {"x": [-1.3, 1.3], "y": [-0.9, 0.9]}
    file.write_text(yaml.safe_dump({"robot": robot, "port": "x", "surface_m": surface, "tracker": tracker}))
    asked = ["trial", "--robot", robot, "--emulated", "--yes", "--rig", file, "--results", tmp_path / "r"]
    assert call(*asked, *soak.QUICK) == 2
    assert re.search(message, capsys.readouterr().err)
    assert not list((tmp_path / "r").rglob("journal.jsonl"))


def test_a_tracker_without_pictures_writes_none(tmp_path, capsys):
    assert call("track", "--emulated", "--seconds", "1s", "--frames", tmp_path / "seen") == 2
    assert "the wii tracker has no pictures to write; leave --frames out" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--print-board", "/proc/none/b.png"], "cannot use /proc/none/b.png"),
        (["--frames", ".", "-o", "/proc/none/c.json"], "there is no folder /proc/none to write c.json into"),
    ],
)
def test_what_calibrating_writes_needs_a_place(capsys, arguments, message):
    assert call("calibrate", *arguments) == 2
    assert message in capsys.readouterr().err


@pytest.mark.filterwarnings("default::bns.hardware.link.sealed_lines.LogWarning")
def test_an_edited_journal_is_refused(tmp_path, capsys):
    assert call(*TRIAL, "--evaluations", 1, "--results", tmp_path) == 0
    journal = journal_of(tmp_path)
    lines = [json.loads(line) for line in journal.read_text().splitlines()]
    for event in lines:
        if event["kind"] == "driven":
            event["picked"][0][0] += 500
    journal.write_text("".join(json.dumps(e) + "\n" for e in lines))
    assert call("trial", "--replay", journal, "--results", tmp_path) == 2
    assert f"line 1 of {journal} was changed" in capsys.readouterr().err
    for event in lines:  # as from before lines had checksums
        del event["n"], event["crc"]
    journal.write_text("".join(json.dumps(e) + "\n" for e in lines))
    assert call("trial", "--replay", journal, "--results", tmp_path) == 2
    said = capsys.readouterr().err
    assert "were written before lines had checksums" in said
    assert "drove another controller than this bns picks" in said


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


def test_given_commands_are_driven_and_measured(tmp_path, capsys):
    file = tmp_path / "proposed.csv"
    file.write_text("trial,left_m_s,right_m_s,duration_s\n1,0.1,0.1,1.0\n1,0.05,0.1,0.5\n2,0.15,0.1,2.0\n")
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path]
    assert call(*asked, "--commands", file) == 0
    assert "2 trials driven" in capsys.readouterr().out
    table = pd.read_csv(tmp_path / "trials" / "experiment-proposed-emulated" / "measurements.csv")
    assert table["trial"].unique().tolist() == [1, 2]
    first = table[table["trial"] == 1]
    assert first["y_m"].iloc[-1] - first["y_m"].iloc[0] == pytest.approx(0.13, abs=0.02)
    assert call(*asked, "--commands", file) == 2
    assert "already; resume it with --resume, move it away" in capsys.readouterr().err


def test_given_commands_are_gone_on_with(tmp_path, capsys):
    file = tmp_path / "proposed.csv"
    file.write_text("trial,left_m_s,right_m_s,duration_s\n" + "".join(f"{n},0.1,0.08,3.0\n" for n in range(1, 5)))
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path, "--commands", file]
    assert call(*asked, "--resume") == 2
    assert "nothing to resume" in capsys.readouterr().err
    assert call(*asked, *faults(tmp_path, {"kind": "hang-up", "at_s": 6, "for_s": 2})) == 3
    table = tmp_path / "trials" / "experiment-proposed-emulated" / "measurements.csv"
    assert 1 <= pd.read_csv(table)["trial"].max() < 4
    assert call(*asked, "--resume") == 0
    assert pd.read_csv(table)["trial"].unique().tolist() == [1, 2, 3, 4]
    file.write_text("trial,left_m_s,right_m_s,duration_s\n1,0.1,0.1,3.0\n")
    assert call(*asked, "--resume") == 2
    assert "drove other commands than the file holds now" in capsys.readouterr().err


def test_given_commands_start_where_the_file_says(tmp_path, capsys):
    file, names = tmp_path / "proposed.csv", "trial,left_m_s,right_m_s,duration_s,start_x_m,start_y_m,start_heading_rad"
    file.write_text(f"{names}\n1,0.1,0.1,0.5,0.3,-0.2,0.0\n2,0.1,0.1,0.5,-0.3,0.1,1.5\n")
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path, "--commands", file]
    assert call(*asked) == 0
    table = pd.read_csv(tmp_path / "trials" / "experiment-proposed-emulated" / "measurements.csv")
    first = table.groupby("trial")[["x_m", "y_m", "heading_rad"]].first()
    np.testing.assert_allclose(first, [[0.3, -0.2, 0.0], [-0.3, 0.1, 1.5]], atol=0.12)
    file.write_text(f"{names}\n1,0.1,0.1,0.5,3.0,0.0,0.0\n")
    assert call(*asked[:-1], file.rename(tmp_path / "far.csv")) == 2
    assert "starts a trial at (3.00, 0.00) m, off the surface x -0.9 to 0.9 m" in capsys.readouterr().err


def test_an_experiment_that_could_not_begin_is_none(tmp_path, capsys):
    file, rig = tmp_path / "proposed.csv", tmp_path / "rig.yaml"
    file.write_text("trial,left_m_s,right_m_s,duration_s\n1,0.1,0.1,1.0\n")
    rig.write_text(
        "robot: khepera\nport: /dev/nowhere\nsurface_m: {x: [-1, 1], y: [-1, 1]}\n"
        "tracker: {kind: wii, device: x, height_m: 2.4, view_rad: 0.75}\n"
    )
    for _ in range(2):
        assert call("trial", "--robot", "khepera", "--rig", rig, "--commands", file, "--results", tmp_path) == 2
        assert "there is no port /dev/nowhere" in capsys.readouterr().err


def test_a_filmed_robot_is_seen_where_it_is_at_any_speed(tmp_path):
    file, rig = tmp_path / "straight.csv", tmp_path / "rig.yaml"
    file.write_text("trial,left_m_s,right_m_s,duration_s\n1,0.1,0.1,2.0\n")
    rig.write_text(
        "robot: khepera\nport: x\nsurface_m: {x: [-0.9, 0.9], y: [-0.7, 0.7]}\n"
        "tracker: {kind: colour, camera: 0, calibration: x, diameter_m: 0.04, height_m: 0.07, distance_m: 0.1}\n"
    )
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path]
    assert call(*asked, "--rig", rig, "--commands", file) == 0
    table = pd.read_csv(tmp_path / "trials" / "experiment-straight-emulated" / "measurements.csv")
    under_way = table[table["t_s"].between(0.6, 1.9)]
    speed_m_s = np.polyfit(under_way["t_s"], under_way["y_m"], 1)[0]
    assert speed_m_s == pytest.approx(0.1, abs=0.005)
    assert np.abs(under_way["y_m"] - np.polyval(np.polyfit(under_way["t_s"], under_way["y_m"], 1), under_way["t_s"])).max() < 0.01


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("trial,left_m_s,right_m_s\n1,0.1,0.1\n", "lacks the column duration_s"),
        ("trial,left_m_s,right_m_s,duration_s\n1,0.1,0.1,1\n1,9,0.1,1\n", "line 3 of"),
        ("trial,left_m_s,right_m_s,duration_s\n1,0.1,x,1\n", "line 2 of"),
        ("", "cannot read the commands"),
    ],
)
def test_bad_commands_are_named_before_anything_moves(tmp_path, capsys, text, message):
    file = tmp_path / "bad.csv"
    file.write_text(text)
    asked = ["trial", "--robot", "khepera", "--emulated", "--results", tmp_path, "--commands", file]
    assert call(*asked) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "trials").exists()


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
