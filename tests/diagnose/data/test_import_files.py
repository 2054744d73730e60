"""Files as labs have them: recordings of ROS, tables with ``#`` headings, odometry and truth apart."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from bns.cli.main import main
from bns.diagnose.data.checks import checked, poses_lost
from bns.diagnose.data.guess.mapping import guessed
from bns.diagnose.data.import_log import import_log
from bns.diagnose.data.load import load_measured
from bns.diagnose.data.sources.read import read_table
from bns.errors import DataError
from tests.diagnose.logs import continuous
from tests.diagnose.worlds import BASE_M, NOMINAL, measured

pytest.importorskip("rosbags")
from tests.diagnose import bags

SHARED = Path(__file__).parents[4] / "shared" / "data"
RADIUS_M = 0.021
UNSAID = "No name says whether the speeds are commanded or measured: check it. Measured, they hide lag and limits."


@pytest.fixture(scope="module")
def table():
    return measured(NOMINAL, trials=3, seed=4)


@pytest.fixture(scope="module")
def log(table):
    return continuous(table)


def filled(guess):
    """The proposal with what no log tells filled in."""
    text = guess.text.replace("METRES,", f"{BASE_M},").replace("METRES\n", f"{BASE_M}\n").replace("RADIUS_M}", f"{RADIUS_M}}}")
    return yaml.safe_load(text)


def same_drives(folder, imported, table):
    """The imported table holds the trials as they were driven."""
    imported.table.to_parquet(folder / "m.parquet")
    tracks = load_measured(folder / "m.parquet").tracks
    assert len(tracks) == table["trial"].nunique()
    for trial, (_, rows) in enumerate(table.groupby("trial")):
        told = np.abs(tracks.left_m_s[trial]) + np.abs(tracks.right_m_s[trial]) > 0
        lasted = rows["t_s"].iloc[-1] - rows["t_s"].iloc[0]
        assert (tracks.duration_s[trial] * told).sum() == pytest.approx(lasted, abs=0.05)
        way = np.abs(tracks.left_m_s[trial] * tracks.duration_s[trial]).sum()
        given = (rows["left_m_s"].abs() * rows["t_s"].diff().shift(-1)).sum()
        assert way == pytest.approx(given, rel=0.03)


@pytest.mark.parametrize("kind", bags.KINDS)
def test_a_recording_becomes_measurements_by_its_own_proposal(tmp_path, table, log, kind):
    topics = {"/cmd_vel": bags.twist, "/vrpn/robot/pose": bags.pose_stamped, "/odom": bags.odometry}
    bag = bags.write_bag(tmp_path, log, topics, kind)
    guess = guessed(read_table(bag))
    assert guess.mapping["columns"]["x_m"] == {"from": "/vrpn/robot/pose.pose.position.x"}
    assert guess.mapping["columns"]["forward_m_s"] == {"from": "/cmd_vel.linear.x"}
    found = import_log([bag], filled(guess))
    assert not [f for f in found.findings if "lost" in f.text]
    assert not any(str(name).startswith("/") for name in found.table.columns)
    same_drives(tmp_path, found, table)


@pytest.mark.parametrize(
    ("topics", "takes", "remark"),
    [
        ({"/cmd": bags.twist_stamped, "/tf": bags.transforms}, "/cmd.twist.linear.x", None),
        ({"/joint_states": bags.joints(RADIUS_M), "/odom": bags.odometry}, "/joint_states.velocity.wheel_left_joint", "measured"),
        ({"/odom": bags.odometry}, "/odom.twist.twist.linear.x", "own odometry"),
    ],
)
def test_what_stands_in_for_commands_and_poses_is_said(tmp_path, log, topics, takes, remark):
    guess = guessed(read_table(bags.write_bag(tmp_path, log.iloc[:400], topics)))
    taken = [entry["from"] for entry in guess.mapping["columns"].values()]
    assert takes in taken
    assert (remark is None) == (not any("own odometry" in r or "measured" in r for r in guess.remarks))
    assert remark is None or any(remark in r for r in guess.remarks)


def test_joint_states_and_transforms_are_measurements_too(tmp_path, table, log):
    bag = bags.write_bag(tmp_path, log, {"/joint_states": bags.joints(RADIUS_M), "/tf": bags.transforms})
    same_drives(tmp_path, import_log([bag], filled(guessed(read_table(bag)))), table)


def test_a_recording_without_commands_says_what_would_serve(tmp_path, log, capsys):
    bag = bags.write_bag(tmp_path, log.iloc[:200], {"/mocap": bags.pose_stamped}, "mcap")
    assert main(["import", str(bag), "-o", str(tmp_path / "m.csv")]) == 2
    said = capsys.readouterr().err
    assert "No column holds the commands. Suitable are" in said
    assert "/cmd_vel" in said
    assert "/mocap.pose.position.x" in said
    assert not (tmp_path / "m.csv").exists()
    with pytest.raises(DataError, match=r"holds the commands. Suitable are"):
        import_log([bag], guessed(read_table(bag)).mapping)


def test_a_damaged_recording_is_named(tmp_path):
    (tmp_path / "a.mcap").write_bytes(b"no recording at all")
    (tmp_path / "empty").mkdir()
    for name in ("a.mcap", "empty", "b.bag"):
        with pytest.raises(DataError, match=name):
            read_table(tmp_path / name)


def test_stamps_of_another_clock_give_way_to_the_recorders(tmp_path, log, monkeypatch):
    monkeypatch.setattr(bags, "EPOCH_NS", bags.EPOCH_NS)
    header = bags.Messages.header
    monkeypatch.setattr(bags.Messages, "header", lambda self, at_s, frame="world": header(self, at_s - 500.0, frame))
    bag = bags.write_bag(tmp_path, log.iloc[:50], {"/mocap": bags.pose_stamped, "/cmd_vel": bags.twist})
    read = read_table(bag)
    assert read["t_s"].iloc[-1] == pytest.approx(log["t_s"].iloc[49], abs=0.01)


def lab_files(folder, log):
    """Odometry with commands as .dat, truth as .txt with a `#` heading at a rate of its own, by one clock."""
    told = log[["t_s", "left_m_s", "right_m_s"]].assign(t_s=log["t_s"] + 1000.0)
    names = "# recorded by us\n# Time [s]    left wheel velocity [m/s]    right wheel velocity [m/s]\n"
    lines = "\n".join(" ".join(f"{v:.6f}" for v in row) for row in told.to_numpy())
    (folder / "Odometry.dat").write_text(names + lines + "\n")
    truth = log.iloc[1::2].assign(t_s=log["t_s"].iloc[1::2] + 1000.013)[["t_s", "x_m", "y_m", "heading_rad"]]
    truth.columns = ["#timestamp", "x", "y", "yaw"]
    truth.to_csv(folder / "groundtruth.txt", index=False, sep="\t")
    return folder / "Odometry.dat", folder / "groundtruth.txt"


def test_two_files_of_a_lab_are_joined_by_time(tmp_path, table, log, capsys):
    first, second = lab_files(tmp_path, log)
    read = read_table(first)
    assert list(read.columns) == ["Time [s]", "left wheel velocity [m/s]", "right wheel velocity [m/s]"]
    guess = guessed(read, {second.name: read_table(second)})
    assert guess.remarks == (UNSAID,)
    (tmp_path / "Odometry.dat.import.yaml").write_text(guess.text)
    assert main(["import", str(first), str(second), "-o", str(tmp_path / "m.parquet")]) == 0
    said = capsys.readouterr().out
    assert "without a pose" in said
    assert "poses lost" not in said
    same_drives(tmp_path, import_log([first]), table)
    assert len(load_measured(first).tracks) == 3  # every command reads it by the mapping beside it


def test_a_file_that_the_mapping_does_not_know_is_refused(tmp_path, log):
    first, second = lab_files(tmp_path, log)
    (tmp_path / "Odometry.dat.import.yaml").write_text(guessed(read_table(first)).text)
    with pytest.raises(DataError, match=r"Odometry.dat.import.yaml, line \d: nothing is taken from .*groundtruth.txt; add"):
        import_log([first, second])


def test_a_table_that_needs_no_mapping_is_taken_as_it_is(tmp_path, table):
    table.to_csv(tmp_path / "t.csv", index=False)
    assert import_log([tmp_path / "t.csv"]).trials == 3


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("# Time [s]   x [m]   orientation [rad]\n1 2 3\n2 3 4\n", ["Time [s]", "x [m]", "orientation [rad]"]),
        ("# timestamp tx ty tz qx qy qz qw\n1 0 0 0 0 0 0 1\n", ["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"]),
        ("% a;b\n1;2\n3;4\n", ["a", "b"]),
        ("1 2 3\n4 5 6\n", ["column_1", "column_2", "column_3"]),
        ("# a note of the author\nt x\n1 2\n", ["t", "x"]),
    ],
)
def test_headings_of_text_files(tmp_path, text, columns):
    path = tmp_path / "log.dat"
    path.write_text(text)
    read = read_table(path)
    assert list(read.columns) == columns
    assert len(read) == len([line for line in text.splitlines() if line[0].isdigit()])
    assert read.dtypes.map(lambda kind: kind.kind in "if").all()


def test_rows_of_commands_alone_are_no_lost_poses():
    t = np.arange(0, 10, 0.01)
    assert poses_lost(t, np.arange(1000) % 4 == 0)[0] == 0
    tracked = np.arange(1000) % 4 == 0
    tracked[200:240] = False
    assert poses_lost(t, tracked) == (10, 197)
    assert poses_lost(np.arange(20.0), np.arange(20) != 7) == (1, 7)
    assert poses_lost(np.arange(20.0), np.arange(20) < 15) == (5, 15)
    assert poses_lost(np.arange(20.0), np.arange(20) > 0) == (1, 0)


def test_frames_that_come_at_uneven_times_are_not_lost():
    """Frames every 30 to 100 ms, and commands in rows of their own; of every twentieth frame the row is there, and no pose."""
    rng = np.random.default_rng(2)
    frames = np.cumsum(rng.uniform(0.03, 0.1, 400))
    commands = np.arange(0.05, frames[-1], 0.1) + 1e-4
    gone = np.arange(400) % 20 == 10
    t_s = np.concatenate([frames, commands])
    tracked = np.concatenate([~gone, np.zeros(len(commands), dtype=bool)])[np.argsort(t_s)]
    lost, _ = poses_lost(np.sort(t_s), tracked)
    assert 5 <= lost <= 20  # two short gaps together may be as long as one that is usual
    whole = np.concatenate([np.ones(400, dtype=bool), np.zeros(len(commands), dtype=bool)])[np.argsort(t_s)]
    assert poses_lost(np.sort(t_s), whole)[0] == 0


@pytest.mark.parametrize("phase", [0.01, 0.31, 0.5, 0.9, 0.99])
def test_a_command_before_the_first_pose_is_no_lost_pose_whenever_the_tracker_comes(phase):
    t = np.concatenate([[0.0], phase + np.arange(20.0)])
    assert poses_lost(t, np.arange(21) > 0)[0] == 0
    assert poses_lost(np.concatenate([[0.0], phase + np.arange(20.0) + 1]), np.arange(21) > 0)[0] == 1


def test_command_rows_give_no_finding(table):
    own = table.assign(t_s=table["t_s"] + 0.01)[["trial", "t_s", "left_m_s", "right_m_s"]]
    both = pd.concat([table, own]).sort_values(["trial", "t_s"], kind="stable").reset_index(drop=True)
    assert not [f for f in checked(both)[1] if "lost" in f.text]


def test_a_log_of_scan_matches_is_seen_for_what_it_is(tmp_path):
    path = SHARED / "khepera3_laser" / "l90_0.tuple"
    if not path.is_file():
        pytest.skip(f"no {path}")
    guess = guessed(read_table(path))
    assert guess.mapping["relative"]
    where = "scale in the entries left_m_s and right_m_s"
    assert guess.remarks == (f"Fill in RADIUS_M ({where}): the radius of the wheels in metres; their speeds are in rad/s.",)
    assert import_log([path], filled(guess)).trials > 100


@pytest.mark.slow
@pytest.mark.parametrize("name", ["diff_drive_optitrack.parquet", "skid_steer_terrains.parquet"])
def test_shared_tables_need_no_mapping(name):
    path = SHARED / name
    if not path.is_file():
        pytest.skip(f"no {path}")
    found = import_log([path])
    assert found.trials > 100
    assert found.poses == len(found.table)


def test_a_log_without_poses_and_commands_says_both():
    path = SHARED / "servo_logs.csv.gz"
    if not path.is_file():
        pytest.skip(f"no {path}")
    with pytest.raises(DataError, match=r"(?s)holds the commands. Suitable are.*No column holds x_m, y_m, heading_rad"):
        import_log([path])


@pytest.mark.parametrize(
    ("names", "factor", "entry", "remark"),
    [
        (("cmd_left", "cmd_right"), 1000, {"unit": "mm/s"}, "in mm/s is guessed"),
        (("left_cmd_mmps", "right_cmd_mmps"), 1000, {"unit": "mm/s"}, None),
        (("cmd_L", "cmd_R"), 100, {"unit": "cm/s"}, "in cm/s is guessed"),
        (("vL_cmd", "vR_cmd"), 1, {}, None),
        (("wheel_l", "wheel_r"), 1 / 0.0205, {"scale": "SCALE_M_S"}, "about 0.02 m per"),
        (("u_l", "u_r"), 1275, {"scale": "SCALE_M_S"}, "about 0.00076 m per"),
        (("left", "right"), 0, {}, None),
    ],
)
def test_commands_without_a_unit_in_their_names_are_read_from_how_far_the_robot_went(table, names, factor, entry, remark):
    left, right = names
    drives = {left: table.left_m_s * factor, right: table.right_m_s * factor}
    poses = {"x": table.x_m, "y": table.y_m, "yaw": table.heading_rad}
    foreign = pd.DataFrame({"run": table.trial, "time": table.t_s, **drives, **poses})
    guess = guessed(foreign)
    assert guess.mapping["columns"]["left_m_s"] == {"from": left, **entry}
    assert guess.mapping["columns"]["right_m_s"] == {"from": right, **entry}
    others = [said for said in guess.remarks if said != UNSAID]
    assert (UNSAID in guess.remarks) == ("cmd" not in left)
    assert len(others) == (remark is not None)
    assert remark is None or remark in others[0]


@pytest.mark.parametrize(
    ("names", "taken"),
    [
        ("v_cmd omega_cmd measured_wheel_l measured_wheel_r x y yaw", {"forward_m_s": "v_cmd", "turn_rad_s": "omega_cmd"}),
        (
            "cmd_vel.linear.x cmd_vel.angular.z encoder_left_rad_s encoder_right_rad_s x_mm mocap_x_mm mocap_y_mm mocap_yaw_deg",
            {"forward_m_s": "cmd_vel.linear.x", "turn_rad_s": "cmd_vel.angular.z", "x_m": "mocap_x_mm", "y_m": "mocap_y_mm"},
        ),
        ("cmd_vel_v cmd_vel_omega wheel_l_rad_s wheel_r_rad_s x y yaw", {"forward_m_s": "cmd_vel_v"}),
        ("left_actual right_actual left_ref right_ref x y yaw", {"left_m_s": "left_ref", "right_m_s": "right_ref"}),
        ("v omega left_meas right_meas x y yaw", {"forward_m_s": "v", "turn_rad_s": "omega"}),
        ("left right v omega odom_x odom_y gt_x gt_y yaw", {"left_m_s": "left", "x_m": "gt_x", "y_m": "gt_y"}),
        ("cmd_left cmd_right cmd_x y yaw", {"left_m_s": "cmd_left", "x_m": None}),
    ],
)
def test_commands_come_before_measured_speeds_and_are_no_poses(names, taken):
    columns = {name: [0.1, 0.2, 0.3, 0.4] for name in ["t", *names.split()]}
    entries = guessed(pd.DataFrame(columns)).mapping["columns"]
    assert {role: entries.get(role, {}).get("from") for role in taken} == taken
    assert len({"left_m_s", "forward_m_s"} & set(entries)) == 1


def test_speeds_of_encoders_are_no_counts():
    log = pd.DataFrame({name: [0.1, 0.2, 0.3] for name in ("t", "encoder_left_rad_s", "encoder_right_rad_s", "x", "y", "yaw")})
    guess = guessed(log)
    assert guess.mapping["columns"]["left_m_s"] == {"from": "encoder_left_rad_s", "scale": "RADIUS_M"}
    assert any("The speeds are measured, not commanded" in said for said in guess.remarks)
    metres = guessed(log.rename(columns=lambda name: name.replace("rad_s", "mm_s"))).mapping["columns"]
    assert metres["left_m_s"] == {"from": "encoder_left_mm_s", "unit": "mm/s"}


def test_the_file_of_commands_is_taken_rather_than_that_of_measured_wheels():
    names = {"odom.csv": "t left right x y yaw", "cmd_vel.csv": "t v omega"}
    odom, told = (pd.DataFrame({name: [0.1, 0.2, 0.3] for name in said.split()}) for said in names.values())
    guess = guessed(odom, {"cmd_vel.csv": told}, "odom.csv")
    assert not {"left_m_s", "right_m_s"} & set(guess.mapping["columns"])
    assert set(guess.mapping["also"][0]["columns"]) == {"t_s", "forward_m_s", "turn_rad_s"}


def test_pauses_between_trials_are_not_driven_and_positions_far_apart_are_no_metres(table):
    foreign = pd.DataFrame({"time": table.t_s + 500.0 * table.trial.astype(int), "cmd_L": 100 * table.left_m_s})
    foreign = foreign.assign(cmd_R=100 * table.right_m_s, x=table.x_m, y=table.y_m, yaw=table.heading_rad).ffill()
    assert guessed(foreign).mapping["columns"]["left_m_s"] == {"from": "cmd_L", "unit": "cm/s"}
    in_mm = foreign.assign(x=1000 * foreign.x, y=1000 * foreign.y)
    assert guessed(in_mm).mapping["columns"]["left_m_s"] == {"from": "cmd_L"}


@pytest.mark.parametrize(
    ("size", "names", "factor", "unit"),
    [
        (100, ("v_left", "v_right"), 1.0, "cm"),
        (1000, ("v_left", "v_right"), 1.0, "mm"),
        (1000, ("cmd_l_mps", "cmd_r_mps"), 1.0, "mm"),
        (100, ("left_cm_s", "right_cm_s"), 100.0, "cm"),
        (100, ("left_rad_s", "right_rad_s"), 1.0, None),  # the radius of the wheels is not known, and may be anything
        (1, ("v_left", "v_right"), 1.0, None),
    ],
)
def test_positions_in_centimetres_and_millimetres_are_known_from_how_far_the_robot_went(table, size, names, factor, unit):
    drives = dict(zip(names, (factor * table.left_m_s, factor * table.right_m_s), strict=True))
    poses = {"x": size * table.x_m, "y": size * table.y_m, "yaw": table.heading_rad}
    guess = guessed(pd.DataFrame({"trial": table.trial, "time": table.t_s, **drives, **poses}))
    entries = guess.mapping["columns"]
    assert (entries["x_m"], entries["y_m"]) == tuple({"from": name, **({"unit": unit} if unit else {})} for name in ("x", "y"))
    said = [f"That the positions are in {unit} is guessed from how far the robot went: check it." in guess.remarks]
    assert said == [unit is not None]
    assert "scale" not in entries["left_m_s"] or not unit


@pytest.mark.parametrize(
    ("size", "factor", "place", "speed"),
    [(1000, 1.0, {"unit": "mm"}, {}), (1, 100.0, {}, {"unit": "cm/s"}), (1, 1.0, {}, {}), (1, 37.0, {}, {})],
)
def test_units_of_a_robot_that_is_told_how_fast_to_go_forward(table, size, factor, place, speed):
    v = factor * (table.left_m_s + table.right_m_s) / 2
    poses = {"x": size * table.x_m, "y": size * table.y_m, "yaw": table.heading_rad}
    entries = guessed(pd.DataFrame({"trial": table.trial, "time": table.t_s, "v": v, "omega": 0.1, **poses})).mapping["columns"]
    assert (entries["x_m"], entries["forward_m_s"]) == ({"from": "x", **place}, {"from": "v", **speed})


@pytest.mark.parametrize(
    ("stands_s", "gap_s", "cut"),
    [
        (1.0, 0.0, {"standing_s": 1.0}),
        (0.9, 0.0, {"lasting_s": 20.0}),
        (0.0, 0.0, {"lasting_s": 20.0}),
        (0.5, 3.0, {"gap_s": 2.0}),
        (1.5, 3.0, {"gap_s": 2.0}),
        (1.5, 1.0, {"standing_s": 1.0}),
    ],
)
def test_a_log_without_trials_is_cut_at_what_it_has(stands_s, gap_s, cut):
    """Two drives of five seconds; between them the robot stands, or nothing is recorded."""
    first, last = np.arange(0.0, 5.0, 0.1), 5.0 + stands_s + gap_s + np.arange(0.0, 5.0, 0.1)
    stood = 5.0 + 0.1 * np.arange(round(10 * stands_s))
    t = np.concatenate([first, stood, last])
    v = np.where((t >= 5.0) & (t < last[0]), 0.0, 0.1)
    log = pd.DataFrame({"time": t, "v": v, "omega": 0.1 * (v > 0), "x": 0.1 * t, "y": 0.0, "yaw": 0.0})
    assert guessed(log).mapping["trials"] == cut
    assert guessed(log.drop(columns=["v", "omega"])).mapping["trials"] == {"standing_s": 1.0}


def drives_and_gaps(gaps_s, lost_s=0.0, stands=0):
    """Poses at 25 Hz and commands at 2 Hz in two tables: drives of 13 s, with ``stands`` of 1.5 s each, then 2 s of standing, and
    gaps in which nothing is written; in the middle of the first drive nothing is written for ``lost_s`` either."""
    poses, times, speeds, begin = [], [], [], 0.0
    for gap_s in (*gaps_s, 0.0):
        own, tick = 0.04 * np.arange(375), 0.5 * np.arange(30)
        still = (tick >= 13.0) | ((tick < 3.0 * stands) & (tick % 3.0 >= 1.0) & (tick % 3.0 < 2.5))
        lost = [(part > 7.0) & (part < 7.0 + lost_s) & (begin == 0.0) for part in (own, tick)]
        poses.append(begin + own[~lost[0]])
        times.append(begin + tick[~lost[1]])
        speeds.append(np.where(still, 0.0, 0.2)[~lost[1]])
        begin += own[-1] + gap_s
    t, told = np.concatenate(poses), np.concatenate(speeds)
    seen = pd.DataFrame({"t_s": t, "x": 0.1 * t, "y": 0.0, "yaw": 0.0})
    return seen, pd.DataFrame({"t_s": np.concatenate(times), "left_m_s": told, "right_m_s": told})


def test_commands_that_are_seconds_apart_hide_no_gap_between_poses():
    seen, told = drives_and_gaps([5.0, 15.0, 8.0])
    rare = told[told.index % 6 == 0].assign(left_m_s=0.2)  # every 3 s; by themselves they have no clear gap
    rare.loc[rare.index % 30 == 24, ["left_m_s", "right_m_s"]] = 0.0  # and end with a stop
    assert rare.t_s.diff().nlargest(3).iloc[-1] < 3 * rare.t_s.diff().nlargest(4).iloc[-1]
    assert guessed(seen, {"commands.csv": rare}, "poses.csv").mapping["trials"] == {"gap_s": 2.0}


@pytest.mark.parametrize(
    ("gaps_s", "lost_s", "stands", "cut"),
    [
        ([5.0, 15.0, 8.0], 0.0, 0, {"gap_s": 2.0}),  # though it stands before each gap
        ([5.0, 15.0, 8.0], 0.0, 2, {"gap_s": 2.0}),
        ([5.0, 15.0, 60.0], 0.0, 0, {"gap_s": 2.0}),
        ([0.04] * 7, 6.0, 0, {"standing_s": 1.0}),  # the tracker failed once in eight drives
    ],
)
def test_a_log_with_clear_gaps_in_time_is_cut_there_though_the_robot_stands_before_them(gaps_s, lost_s, stands, cut):
    seen, told = drives_and_gaps(gaps_s, lost_s, stands)
    found = guessed(seen, {"commands.csv": told}, "poses.csv").mapping["trials"]
    assert found == cut


def test_where_rows_are_seconds_apart_the_gap_that_is_proposed_is_longer():
    """A row every 2.5 s, at the ends of commands; 10 s between trials: neither all rows are trials nor is none."""
    t = np.cumsum(np.tile([10.0, *[2.5] * 8], 6))
    log = pd.DataFrame({"time": t, "v": np.tile([0.1] * 8 + [0.0], 6), "omega": 0.0, "x": 0.1 * t, "y": 0.0, "yaw": 0.0})
    assert guessed(log).mapping["trials"] == {"gap_s": 5.0}
    gone = log.iloc[np.delete(np.arange(len(log)), [13])]  # twice as long once is no clear gap, but the 10 s stay what is clear
    assert guessed(gone).mapping["trials"] == {"standing_s": 1.0}


@pytest.mark.parametrize("unit", [1.0, 180 / np.pi], ids=["rad", "deg"])
@pytest.mark.parametrize(
    "convention",
    [{}, {"zero_deg": 90}, {"clockwise": True}, {"clockwise": True, "zero_deg": 90}, {"clockwise": True, "zero_deg": 180}],
    ids=str,
)
def test_how_headings_are_counted_is_read_from_where_the_robot_drove(table, convention, unit):
    turned = table.heading_rad - np.radians(convention.get("zero_deg", 0))
    heading = np.mod(-turned if "clockwise" in convention else turned, 2 * np.pi) * unit
    foreign = pd.DataFrame({"time": table.t_s, "cmd_l_mps": table.left_m_s, "cmd_r_mps": table.right_m_s})
    foreign = foreign.assign(x=table.x_m, y=table.y_m, compass=heading)
    body = foreign.drop(columns=["cmd_l_mps", "cmd_r_mps"]).assign(v=(table.left_m_s + table.right_m_s) / 2, omega=0.0)
    guess, of_body = guessed(foreign), guessed(body)
    assert guess.mapping["columns"]["heading_rad"] == {"from": "compass", **({"unit": "deg"} if unit > 1 else {}), **convention}
    assert of_body.mapping["columns"]["heading_rad"] == guess.mapping["columns"]["heading_rad"]
    assert any("How the heading is counted is guessed" in remark for remark in guess.remarks) == bool(convention)


def test_a_path_that_hardly_turns_tells_no_convention(table):
    one = table.assign(trial=0, t_s=0.1 * np.arange(len(table)), left_m_s=0.1, right_m_s=0.1, y_m=0.0, heading_rad=0.01)
    one["x_m"] = 0.1 * one.t_s
    foreign = one.rename(columns={"left_m_s": "l", "right_m_s": "r", "x_m": "x", "y_m": "y", "heading_rad": "yaw"})
    assert guessed(foreign).mapping["columns"]["heading_rad"] == {"from": "yaw"}


def test_times_and_motor_steps_are_known_by_their_short_names(table):
    foreign = pd.DataFrame({"ms": 1e3 * table.t_s, "steps_l": 1e4 * table.left_m_s, "steps_r": 1e4 * table.right_m_s})
    rates = foreign.rename(columns={"steps_l": "left_steps_per_s", "steps_r": "right_steps_per_s"})
    columns, of_rates = (guessed(one).mapping["columns"] for one in (foreign, rates))
    assert columns["t_s"] == {"from": "ms", "unit": "ms"}
    assert columns["left_m_s"] == {"from": "steps_l", "scale": "METRES_A_COUNT", "counts": True}
    assert of_rates["right_m_s"] == {"from": "right_steps_per_s", "scale": "METRES_A_COUNT"}


def test_a_proposal_is_printed_and_can_be_saved(tmp_path, table, capsys):
    log = tmp_path / "my log.csv"
    table.rename(columns={"t_s": "time", "x_m": "x", "y_m": "y", "heading_rad": "yaw"}).to_csv(log, index=False)
    assert main(["import", str(log), "-o", str(tmp_path / "m.csv")]) == 2
    assert f"bns import '{log}' --propose > '{log}.import.yaml'" in capsys.readouterr().err
    assert main(["import", str(log), "--propose"]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert not (tmp_path / "m.csv").exists()
    mapping = log.with_name("my log.csv.import.yaml")
    assert main(["import", str(log), "--propose", "-o", str(tmp_path / "m.csv")]) == 2
    assert "is no name for a mapping" in capsys.readouterr().err
    assert main(["import", str(log), "--propose", "-o", str(mapping)]) == 0
    assert mapping.read_text() == shown.out
    assert main(["import", str(log), "--propose", "-o", str(mapping)]) == 2
    assert "may have been corrected by hand" in capsys.readouterr().err
    assert not (tmp_path / "m.csv").exists()
    assert main(["import", str(log), "-o", str(tmp_path / "m.csv")]) == 0
    assert len(load_measured(tmp_path / "m.csv").tracks) == 3


def test_import_asks_for_a_table_to_write(tmp_path, table, capsys):
    table.to_csv(tmp_path / "m.csv", index=False)
    assert main(["import", str(tmp_path / "m.csv")]) == 2
    assert "Give -o FILE" in capsys.readouterr().err
