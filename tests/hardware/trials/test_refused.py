"""What a trial refuses, and how it says so, before anything moves."""

import json
import re
from types import SimpleNamespace

import pytest
import yaml

from bns.hardware.clock import EmulatedClock
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.rig import parse_rig
from bns.spec import RunSpec
from bns.trial.again.replay import replayed
from bns.trial.folder import spec_event

from .. import soak
from .calls import TRIAL, call, journal_of


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
        ({"surface_m": {"x": [-1, 1], "y": [0.5, 0.5]}}, "must be the smaller one"),
        ({"surface_m": {"x": ["-0.9", "0.9"], "y": [-1, 1]}}, "write {x: "),
        ({"surface_m": {"x": [True, 2], "y": [-1, 1]}}, "write {x: "),
        ({"surface_m": 3}, "surface_m is 3; write"),
        ({"robot": "snake"}, "is a rig for snake, and the trial is for khepera"),
        ({"prot": 1}, "unknown key 'prot'. Did you mean 'port'"),
        ({"tracker": {}}, "it needs a kind"),
        ({"lost_s": -1}, "lost_s is -1; it must be a number above 0"),
        ({"lost_s": 500}, "lost_s is 500 s; at most 10 s. It is in seconds, not milliseconds"),
        ({"picture_s": 250}, "picture_s is 250 s; at most 10 s"),
        ({"disagree_s": 500}, "disagree_s is 500 s; at most 10 s"),
        ({"late_s": 1000}, "late_s is 1000 s; at most 30 s"),
        ({"silent_s": 300}, "silent_s is 300 s; at most 30 s"),
        ({"gives_up_s": 14400000}, "gives_up_s is 14400000 s; at most 604800 s"),
        ({"surface_m": {"x": [-90, 90], "y": [-1, 1]}}, "surface_m is 180 m long; at most 100. Its numbers are in metres"),
        ({"placed_within_rad": 20}, "line .: placed_within_rad is 20; at most π. It is in radians, not degrees: 20° are 0.35"),
        ({"placed_within_m": 100}, "line .: placed_within_m is 100; at most 2, the length of surface_m. It is in metres"),
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


@pytest.mark.parametrize(
    ("said", "near"), [("", (0.1, 0.35)), ("placed_within_m: 0.05\n", (0.05, 0.35)), ("placed_within_rad: 0.2\n", (0.1, 0.2))]
)
def test_how_near_its_start_a_robot_is_placed_is_said_of_place_and_heading_apart(said, near):
    rig = parse_rig(f"robot: khepera\nport: x\nsurface_m: {{x: [-1, 1], y: [-1, 1]}}\ntracker: {{kind: wii}}\n{said}", "rig")
    assert (rig.placed_within_m, rig.placed_within_rad) == near


WII = {"kind": "wii", "device": "x", "height_m": 2.4, "view_rad": 0.75}
COLOUR = {"kind": "colour", "camera": 0, "calibration": "none.json", "diameter_m": 0.04, "height_m": 0.07}


@pytest.mark.parametrize(
    ("robot", "tracker", "message"),
    [
        ("khepera", {"kind": "radar"}, "unknown kind of tracker 'radar'"),
        ("khepera", WII | {"height_m": -1}, "height_m is -1; it must be a number above 0"),
        ("khepera", WII | {"height_m": 2400}, "wii tracker: height_m is 2400; at most 20. It is in metres, not millimetres"),
        ("khepera", WII | {"view_rad": 43}, "wii tracker: view_rad is 43; at most 3.14. It is in radians, not degrees"),
        ("snake", COLOUR | {"diameter_m": 60}, "colour tracker: diameter_m is 60; at most 20. It is in metres"),
        ("khepera", WII | {"x_m": "left"}, "has a setting that is no number"),
        ("khepera", {"kind": "colour"}, "lacks camera, calibration, diameter_m, height_m"),
        ("khepera", COLOUR | {"diameter_m": "abc"}, "diameter_m is 'abc'; it must be a number above 0"),
        ("khepera", COLOUR | {"yellow": [20, 90]}, "marker colours are too close"),
        ("khepera", COLOUR | {"yellow": [90, 20]}, r"yellow is \[90, 20\]; write two hues"),
        ("khepera", {**COLOUR, "kind": "aruco"}, "lacks side_m"),
        ("snake", WII, "distinguished by colour; its tracker is wii"),
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


@pytest.mark.parametrize(
    ("ends", "said"), [(False, "the trial did not come to its end"), (True, "stored in sweep trials-replayed")]
)
def test_a_journal_of_a_trial_that_was_cut_short_is_said_to_be_so(tmp_path, monkeypatch, ends, said):
    evals = {"evaluated_fitness_world": [0.5], "evaluated_goals_reached": [1]}
    monkeypatch.setattr("bns.trial.again.replay.run", lambda *_: SimpleNamespace(tables={"evals": evals}))
    monkeypatch.setattr("bns.trial.again.replay.keep_run", lambda *_: None)
    journal = tmp_path / "journal.jsonl"
    with HardwareLog(journal, EmulatedClock(1.0)) as log:
        log.note("trial", spec=spec_event(RunSpec(world="robot", evaluations=30)))
        log.note("driven", evaluation=1, picked=[[1, 1, 1]], commands=[[1, 1, 1]], poses=[[0, 0, 0], [0, 0, 0]])
        log.note("evaluated", evaluation=1, rounds=1)
        if ends:
            log.note("complete", evaluations=1)
    text = replayed(journal, tmp_path).text
    assert text.endswith(said)
    assert ("1 of the 30 evaluations of an unfinished trial" in text) is not ends
