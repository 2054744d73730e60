"""The snake on its emulated rig: drives against the physics model, whole trials, what goes wrong."""

import re
import tempfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml

import bns
from bns.cli.main import main
from bns.errors import HardwareError, TrialPausedError
from bns.hardware.doctor import examine
from bns.hardware.emulators.faults import Fault, FaultPlan
from bns.hardware.link.hardware_log import HardwareLog, events
from bns.hardware.platforms import snake
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping
from bns.hardware.servos.snake_settings import snake_settings
from bns.hardware.tracking.eye import Eye
from bns.physics.snake.body import Body
from bns.physics.snake.parameters import shipped_parameters
from bns.robots import load_robot
from bns.robots.snake.table import GAIT
from bns.trial.folder import measured, past_evaluations

from .. import soak

GENTLE = [0.5, 0.1, 0.6, 0.7, 1.0]
ROLLING = [1.45, 1.3, 0.2, 1.5, 1.0]
TRIAL = ["trial", "--robot", "snake", "--emulated", "--yes", "--speed", "inf", *soak.QUICK, *soak.KINDS["snake"].options]


@pytest.fixture
def rigged(tmp_path, clock):
    """rigged(*faults, **driver) -> platform, emulation, journal."""
    opened = []

    def build(*faults, stopping=None, lost_s=None, prepare=lambda _emulation: None, **driver):
        rig = shipped_rig("snake")
        limits = replace(rig.limits, lost_s=lost_s or rig.limits.lost_s)
        rig = replace(rig, driver={**rig.driver, **driver}, limits=limits)
        emulation = snake.emulate(rig, Path(tempfile.mkdtemp(dir=tmp_path)), clock, FaultPlan(faults, 1), 0)
        opened.append(emulation)
        prepare(emulation)
        journal = HardwareLog(tmp_path / f"snake{len(opened)}.jsonl", clock)
        platform = snake.open_platform(emulation.rig, clock, journal, stopping or Stopping())
        opened.extend([journal, platform])
        return SimpleNamespace(platform=platform, emulation=emulation, journal=journal)

    yield build
    for each in reversed(opened):
        each.close()


def torques(rigged):
    return [servo.get("torque_enable") for servo in rigged.emulation.servos]


@pytest.mark.parametrize(("x", "y", "heading"), [(1.3, 0.9, 0.0), (1.3, 0.9, 1.57), (-1.3, -0.9, 0.8), (-1.3, 0.9, 3.1)])
def test_the_camera_sees_the_robot_everywhere_on_the_surface(rigged, x, y, heading):
    on = rigged(wiring="bridge")
    on.emulation.put_down(np.array([x, y, heading]))
    seen = on.platform.pose()
    np.testing.assert_allclose(seen[:2], [x, y], atol=0.01)
    assert np.cos(seen[2] - heading) > np.cos(0.02)


@pytest.mark.parametrize("joint_speed_rad_s", [1.0, 2.5])
def test_how_long_a_drive_takes_is_announced_by_the_joints_speed(rigged, joint_speed_rad_s):
    on, cycles = rigged(joint_speed_rad_s=joint_speed_rad_s), np.array([GENTLE, GENTLE], np.float32)
    announced_s = on.platform.lasts_s(cycles)
    spans = on.platform.drive(cycles).spans_s
    assert announced_s == pytest.approx(spans[-1][1] - spans[0][0], rel=0.15)


@pytest.mark.parametrize("wiring", ["bus", "bridge"])
def test_an_emulated_drive_is_that_of_the_physics_model(rigged, wiring):
    on = rigged(wiring=wiring)
    driven = on.platform.drive(np.array([GENTLE, GENTLE], np.float32))
    body = Body(shipped_parameters())
    body.lay_straight((0.30, 0.0))
    for seen in driven.poses[1:]:
        true = body.drive_cycle(GENTLE[:4])
        np.testing.assert_allclose(seen[:4], true.before_m.ravel(), atol=0.02)
        np.testing.assert_allclose(seen[4:8], true.after_m.ravel(), atol=0.02)
    assert driven.poses[:, 8].all()
    assert np.hypot(*(driven.poses[-1, 4:6] - driven.poses[0, 4:6])) > 0.1
    assert len(driven.spans_s) == len(driven.commands) == 2
    assert driven.stop.confirmed
    assert driven.stop.acknowledged_s <= 0.2
    assert not any(torques(on))


def test_a_slow_tracker_does_not_leave_a_bridge_without_a_frame_before_the_first_posture(rigged, clock, monkeypatch):
    on, look = rigged(wiring="bridge"), Eye.look

    def slowly(eye):
        clock.sleep(0.06)  # ten looks at the straight robot then take longer than the bridge waits for a frame
        return look(eye)

    monkeypatch.setattr(Eye, "look", slowly)
    driven = on.platform.drive(np.array([GENTLE], np.float32))
    assert (driven.ended, len(driven.commands)) == ("", 1)


def test_a_robot_that_rolls_over_is_stopped_and_its_cycle_is_unstable(rigged):
    on = rigged(lost_s=2.5)  # long enough to go over, not only to hide a marker on the way
    driven = on.platform.drive(np.array([GENTLE, ROLLING, GENTLE], np.float32))
    assert "has not seen the robot" in driven.ended
    assert driven.poses[:, 8].tolist() == [1.0, 1.0, 0.0]
    assert len(driven.commands) == 2
    assert [on.emulation.unstable_between(*span) for span in driven.spans_s] == [False, True]
    assert not any(torques(on))
    assert on.platform.pose() is None
    on.emulation.put_down(np.array([0.1, 0.2, 0.3]))
    np.testing.assert_allclose(on.platform.pose(), [0.1, 0.2, 0.3], atol=0.01)


def test_arming_does_not_move_the_robot(rigged, clock):
    on = rigged()
    before = on.platform.pose()
    on.platform._chain.arm()
    clock.sleep(0.5)
    assert all(torques(on))
    np.testing.assert_allclose(on.platform.pose(), before, atol=0.002)
    assert on.platform.stop().confirmed


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (Fault("overload", at_s=3.0, for_s=0.5, servo=4), "servo 4: overload; fix the cause, then switch the servos off and on"),
        (Fault("overheat", at_s=3.0, for_s=5.0, servo=7), "servo 7: overheated"),
        (Fault("silent-servo", at_s=3.0, for_s=1.5, servo=12), "servo 12: .*asked 6 times"),
        (Fault("hang-up", at_s=3.0, for_s=1.0), "the port is gone"),
    ],
)
def test_servos_that_fail_pause_the_trial_with_the_robot_stopped(rigged, fault, message):
    on = rigged(fault)
    with pytest.raises(TrialPausedError, match=f"the servos failed: {message}"):
        on.platform.drive(np.array([GENTLE] * 3, np.float32))
    assert not any(torques(on))


@pytest.mark.parametrize("at_s", [2.5, 3.0])
@pytest.mark.parametrize(
    "driver", [{"wiring": "bus"}, {"wiring": "bridge"}, {"wiring": "bus", "protocol": 2, "model": "XL430-W250"}]
)
def test_a_servo_that_restarts_pauses_the_trial_and_its_drive_is_not_kept(rigged, driver, at_s):
    on = rigged(Fault("restart", at_s=at_s, servo=4), **driver)
    with pytest.raises(TrialPausedError, match="the servos failed: servo 4 has restarted: its torque"):
        on.platform.drive(np.array([GENTLE] * 3, np.float32))
    assert not any(torques(on))
    assert all(servo.get("torque_limit") for servo in on.emulation.servos)


def test_a_supply_that_dips_pauses_the_trial_and_leaves_no_row(tmp_path, capsys):
    plan = tmp_path / "faults.yaml"
    plan.write_text(yaml.safe_dump({"faults": [{"kind": "restart", "at_s": 3.0, "id": number} for number in range(1, 13)]}))
    asked = [*TRIAL, "--evaluations", 1, "--results", tmp_path]
    assert call(*asked, "--faults", plan) == 3
    assert "servo 1 has restarted" in capsys.readouterr().err
    [journal] = (tmp_path / "trials").glob("*/journal.jsonl")
    assert not past_evaluations(journal)
    assert not len(measured(journal))


def test_a_limit_in_a_servo_that_cuts_the_gait_is_named(rigged):
    """One that came to be after the servos were looked at."""
    on = rigged(wiring="bridge")
    on.emulation.servos[2].put("ccw_angle_limit", 530)
    with pytest.raises(TrialPausedError, match=r"joint 3 should go to 2\d°, but the command was clipped to 5°: widen"):
        on.platform.drive(np.array([GENTLE], np.float32))
    assert not any(torques(on))


def examined(rigged, clock, tmp_path, **driver):
    on = rigged(**driver)
    on.platform._chain.close()
    return on, lambda: [str(found) for found in examine(on.emulation.rig, clock, tmp_path)]


@pytest.mark.parametrize("wiring", ["bus", "bridge"])
@pytest.mark.parametrize(
    ("low", "high", "message"),
    [
        (0, 0, "servo 5 is in wheel mode: both its angle limits are 0"),
        (300, 723, "servo 5 has the angle limits 300 to 723; a gait needs 205 to 818, 90° to both sides"),
        (206, 1023, "servo 5 has the angle limits 206 to 1023"),
        (0, 817, "servo 5 has the angle limits 0 to 817"),
        (205, 818, ""),
    ],
)
def test_servos_that_cannot_bend_as_a_gait_needs_do_not_move(rigged, clock, tmp_path, wiring, low, high, message):
    made = []

    def prepare(emulation):
        made.append(emulation)
        emulation.servos[4].put("cw_angle_limit", low)
        emulation.servos[4].put("ccw_angle_limit", high)

    if message:
        with pytest.raises(HardwareError, match=f"{message}.*bns servos check --fix"):
            rigged(prepare=prepare, wiring=wiring)
    else:
        rigged(prepare=prepare, wiring=wiring).platform._chain.close()
    assert not any(servo.get("torque_enable") for servo in made[0].servos)
    said = [str(found) for found in examine(made[0].rig, clock, tmp_path)]
    assert any(message in found and found.startswith("BAD") for found in said) == bool(message)


@pytest.mark.parametrize("wiring", ["bus", "bridge"])
@pytest.mark.slow
def test_the_doctor_asks_the_servos(rigged, clock, tmp_path, wiring):
    on, said = examined(rigged, clock, tmp_path, wiring=wiring)
    assert f"ok   12 servos answer ({wiring}), 12.0 V or more, 30 °C or less" in said()
    on.emulation.servos[4].put("present_voltage", 80)
    assert any("servo 5 has 8.0 V, not 9 to 12.5; check the supply" in found and found.startswith("BAD") for found in said())


@pytest.mark.parametrize(
    ("driver", "message"),
    [
        ({"wiring": "radio"}, "unknown wiring of the snake 'radio'"),
        ({"ids": [1, 2, 3]}, "give 12 different whole numbers"),
        ({"ids": [1] * 12}, "give 12 different whole numbers"),
        ({"torque": 2.0}, "torque is 2; it is a fraction"),
        ({"joint_speed_rad_s": 0}, "joint_speed_rad_s is 0; it must be a number above 0"),
        ({"joint_speed_rad_s": 86}, "joint_speed_rad_s is 86; without load the AX-12 turns at 6.2. It is in radians a second"),
        ({"stuck_s": 1000}, "stuck_s is 1000; at most 10. It is in seconds, not milliseconds"),
        ({"stalled_s": 250}, "stalled_s is 250; at most 10"),
        ({"settle_s": 200}, "settle_s is 200; at most 10"),
        ({"temperature_c": 338}, "temperature_c is 338; at most 85. It is in degrees Celsius"),
        ({"load": 95}, "load is 95; at most 1. It is a fraction of the permitted torque"),
        ({"low_v": 90}, "low_v is 90, and high_v 12.5; low_v must be the lower one"),
        ({"sped": 1}, "unknown setting 'sped'"),
    ],
)
def test_driver_settings_that_make_no_sense(driver, message):
    with pytest.raises(HardwareError, match=message):
        snake_settings(driver)


def call(*arguments):
    return main([str(a) for a in arguments])


@pytest.mark.slow
def test_from_command_to_table_and_replay(tmp_path, capsys):
    assert TRIAL[-2:] == ["--repeats", "1"]
    asked = [option for option in TRIAL[:-2] if option != "--no-figures"]  # as often as a snake is driven
    assert call(*asked, "--evaluations", 2, "--results", tmp_path) == 0
    said = capsys.readouterr().out
    assert "snake, two-regions, seed 0, emulated" in said
    assert "stops: 4 confirmed" in said
    assert "final controller driven 3 times" in said
    [journal] = (tmp_path / "trials").glob("*/journal.jsonl")
    table = pd.read_csv(journal.parent / "measurements.csv")
    assert set(load_robot("snake").measured_columns) <= set(table)
    assert {"session_s", "battery_v", "temperature_c"} <= set(table)
    for number, drive in table.groupby("trial"):
        assert (drive["t_s"].diff().dropna() > 0).all()
        assert drive["cycle"].dropna().diff().dropna().between(0, 1).all()
        assert np.isnan(drive["cycle"].iloc[-1])
        assert np.hypot(drive["yellow_x_m"] - drive["green_x_m"], drive["yellow_y_m"] - drive["green_y_m"]).max() < 0.75
        kept = past_evaluations(journal)[number - 1]
        [ended] = [e["ended"] for e in events(journal, "driven") if e["evaluation"] == number]
        assert len(kept.commands) == drive["cycle"].max() - ("left the surface" in ended)  # which cuts a cycle off
    marked = {e["evaluation"]: e["unstable"] for e in events(journal, "marked")}
    assert {n: list(e.unstable) for n, e in enumerate(past_evaluations(journal), 1) if e.unstable} == marked
    assert (journal.parent / "path.png").exists()
    repeats = pd.read_csv(journal.parent / "repeats.csv")
    assert repeats["repeat"].unique().tolist() == [1, 2, 3]
    starts = repeats.loc[repeats["step"] == 0, ["x_m", "y_m", "heading_rad"]]
    np.testing.assert_allclose(starts, [[0.3, 0.0, 0.0]] * 3, atol=1e-9)
    assert f"figures: {journal.parent / 'figures' / 'index.html'}" in said
    assert {"paths-snake-two-regions.png", "trials-snake.png"} <= {f.name for f in (journal.parent / "figures").iterdir()}

    assert call("trial", "--replay", journal, "--results", tmp_path) == 0
    rows = bns.load(tmp_path)
    first, again = (rows[rows["sweep"] == s].reset_index(drop=True) for s in ("trials-emulated", "trials-replayed"))
    same = [c for c in rows.columns if c not in {"run_id", "sweep"} and not c.endswith("_s")]
    pd.testing.assert_frame_equal(first[same], again[same])


def test_given_cycles_are_driven_and_held_against_a_model(tmp_path, capsys):
    file = tmp_path / "cycles.csv"
    row = ",".join(str(v) for v in GENTLE[:4])
    file.write_text(f"trial,a_lat_rad,a_vert_rad,omega_rad,alpha_rad\n1,{row}\n1,{row}\n2,{row}\n")
    asked = ["trial", "--robot", "snake", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path, "--commands", file]
    assert call(*asked) == 0
    assert "2 trials driven" in capsys.readouterr().out
    found = tmp_path / "trials" / "experiment-cycles-emulated" / "measurements.csv"
    table = pd.read_csv(found)
    assert table.groupby("trial")["cycle"].max().to_dict() == {1: 2, 2: 1}
    np.testing.assert_allclose(table[list(GAIT)].dropna().drop_duplicates(), [GENTLE[:4]], atol=1e-6)
    assert call("compare", found, "--model", "snake-networks") == 0
    assert "2 trials, 6 tracked poses, model snake" in capsys.readouterr().out  # a begin and an end of each cycle


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("1,0.5,0.1,0.6", "lacks the column alpha_rad"),
        ("a,0.5,0.1,0.6,0.7", "line 2 of .* has 'a' in the column trial; number the trials"),
        ("1,0.5,0.1,0.6,9", "line 2 of .* is no command of a snake; allowed is a_lat_rad 0 to 1.571"),
        ("1,0.5,0.6,0.6,0", "a_vert_rad must be below its a_lat_rad"),
    ],
)
def test_cycles_that_are_none_are_named_before_anything_moves(tmp_path, capsys, row, message):
    file, names = tmp_path / "bad.csv", ["trial", "a_lat_rad", "a_vert_rad", "omega_rad", "alpha_rad"]
    file.write_text(",".join(names[: row.count(",") + 1]) + f"\n{row}\n")
    assert call("trial", "--robot", "snake", "--emulated", "--results", tmp_path, "--commands", file) == 2
    assert re.search(message, capsys.readouterr().err)
    assert not (tmp_path / "trials").exists()


def test_a_pause_is_gone_on_with(tmp_path, capsys):
    plan = tmp_path / "faults.yaml"
    plan.write_text(yaml.safe_dump({"faults": [{"kind": "hang-up", "at_s": 3, "for_s": 1}]}))
    asked = [*TRIAL, "--evaluations", 1, "--results", tmp_path, "--seed", 1]
    assert call(*asked, "--faults", plan) == 3
    assert "the servos failed: the port is gone" in capsys.readouterr().err
    assert call(*asked, "--resume") == 0


def test_a_robot_that_is_lost_while_it_straightens_has_driven_nothing(rigged, clock, tmp_path):
    on = rigged(Fault("lost-marker", at_s=3.0, for_s=60.0))
    on.platform._chain.arm()
    on.platform._chain.move([1.0, 0.0] * 6, [1.0] * 12)  # bent, so that straightening takes time
    clock.sleep(3.0 - clock.now_s())
    driven = on.platform.drive(np.array([GENTLE], np.float32))
    assert "has not seen the robot" in driven.ended
    assert (len(driven.commands), len(driven.poses), driven.rows) == (0, 0, [])
    assert not any(torques(on))
    on.journal.note("driven", evaluation=1, rows=driven.rows, session_s=0.0, readings={})
    on.journal.sync()
    assert measured(tmp_path / "snake1.jsonl").empty


@pytest.mark.slow
def test_ten_trials_with_faults_at_random(tmp_path):
    ends = [soak.judged(seed, tmp_path, "snake") for seed in range(10)]
    assert set(ends) <= {"done", "paused, resumed", "stop not confirmed, and shouted", "refused before it moved"}
    assert ends.count("done") >= 2
