"""Logs as labs have them: what `bns import` makes of them, and what it says where it cannot."""

import gzip
import re

import numpy as np
import pandas as pd
import pytest
import yaml

from bns.cli.main import main
from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.checks import checked
from bns.diagnose.data.guess.mapping import guessed
from bns.diagnose.data.load import load_measured
from bns.diagnose.data.mapping import load_mapping
from bns.diagnose.data.merge_topics import held, without_commands
from bns.diagnose.data.quaternions import yaw
from bns.diagnose.data.sources.read import read_table
from bns.diagnose.data.split_trials import KEPT_S, RUN_UP_S, split
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.data.units import check_units
from bns.diagnose.predict.check_robot import check_same_robot
from bns.diagnose.predict.paired_errors import paired_errors
from bns.diagnose.predict.wheels import WheelPredictor
from bns.errors import DataError
from tests.diagnose.logs import continuous, ros
from tests.diagnose.worlds import BASE_M, NOMINAL, hidden, measured


def test_what_a_proposal_leaves_over_is_listed_where_something_is_missing():
    rows = {"zeit_ms": [0, 40, 80], "v_links": [1, 1, 1], "x_cm": [0, 1, 2], "y_cm": [0, 0, 0], "winkel": [0, 0, 0]}
    remarks = guessed(pd.DataFrame(rows)).remarks
    assert "Not assigned: v_links, winkel. Add an entry for each that is needed." in remarks
    assert not any("spread over" in remark for remark in remarks)
    whole = measured(NOMINAL, trials=3)
    assert not any("Not assigned" in remark for remark in guessed(whole.assign(odd=1.0)).remarks)


@pytest.mark.parametrize(("factor", "said"), [(1.0, False), (1000.0, True)])
def test_positions_that_spread_too_far_for_metres_are_pointed_at(factor, said):
    """Of wheels in rad/s nobody knows how far they went."""
    table = measured(NOMINAL, trials=3)
    seen = pd.DataFrame({"time": table.t_s, "wl": table.left_m_s / 0.02, "wr": table.right_m_s / 0.02, "yaw": table.heading_rad})
    seen = seen.assign(X=table.x_m * factor, Y=table.y_m * factor)
    remarks = guessed(seen).remarks
    assert any("unless these are metres" in remark for remark in remarks) is said


def test_names_of_a_field_robot_are_known():
    table = measured(NOMINAL, trials=4)
    log = pd.DataFrame({"mission": table.trial, "gps_time": table.t_s, "left_kmh": 3.6 * table.left_m_s})
    log = log.assign(right_kmh=3.6 * table.right_m_s, easting=table.x_m + 455_000.0, northing=table.y_m + 5_812_000.0)
    log = log.assign(course=np.degrees(np.pi / 2 - table.heading_rad) % 360.0, battery_pct=95.0)
    found = guessed(log).mapping["columns"]
    assert found["trial"] == {"from": "mission"}
    assert found["left_m_s"] == {"from": "left_kmh", "unit": "km/h"}
    assert (found["x_m"]["from"], found["y_m"]["from"]) == ("easting", "northing")
    assert found["heading_rad"] == {"from": "course", "unit": "deg", "clockwise": True, "zero_deg": 90}


@pytest.mark.parametrize(("name", "size", "unit"), [("omega_deg", 180 / np.pi, {"unit": "deg/s"}), ("omega_rad", 1.0, {})])
def test_a_turn_rate_may_have_the_unit_of_an_angle(name, size, unit):
    table = measured(NOMINAL, trials=4)
    forward, turn = (table.left_m_s + table.right_m_s) / 2, (table.right_m_s - table.left_m_s) / BASE_M
    log = pd.DataFrame({"run": table.trial, "ms": 1e3 * table.t_s, "v": forward, name: size * turn})
    found = guessed(log.assign(px=table.x_m, py=table.y_m, theta=table.heading_rad)).mapping
    assert found["columns"]["forward_m_s"] == {"from": "v"}
    assert found["columns"]["turn_rad_s"] == {"from": name, **unit}
    assert "wheelbase_m" in found


SLIPPING = hidden(turn_slip={"slip_s": 0.12})
TURNS = [f"pose.orientation.{axis}" for axis in "xyzw"]
PLACES = ("pose.position.x", "pose.position.y")
MILLIMETRES = {"X [mm]": [1, 2], "Y [mm]": [1, 2]}
ROS = {
    "columns": {
        "t_s": {"from": "stamp", "unit": "ns"},
        "x_m": {"from": "pose.position.x"},
        "y_m": {"from": "pose.position.y"},
        "heading_rad": {"from": TURNS, "unit": "quaternion"},
    },
    "also": [
        {
            "file": "cmd_vel.csv",
            "columns": {
                "t_s": {"from": "stamp", "unit": "ns"},
                "forward_m_s": {"from": "linear.x"},
                "turn_rad_s": {"from": "angular.z"},
            },
        }
    ],
    "wheelbase_m": BASE_M,
    "hold_commands_s": float("inf"),
    "trials": {"standing_s": 2.0},
}


def mapped(tmp_path, **changes):
    path = tmp_path / "m.yaml"
    path.write_text(yaml.safe_dump({**ROS, **changes}))
    return load_mapping(path)


@pytest.fixture
def bag(tmp_path):
    """A robot whose turns slip, in the tables of a bag: poses and commands at rates of their own, one long log."""
    table = measured(SLIPPING, trials=12, seed=2)
    poses, commands = ros(continuous(table))
    poses.to_csv(tmp_path / "odom.csv", index=False)
    commands.to_csv(tmp_path / "cmd_vel.csv", index=False)
    (tmp_path / "odom.csv.import.yaml").write_text(yaml.safe_dump(ROS))
    return tmp_path, table


def test_a_bag_is_read_as_the_trials_that_it_holds(bag):
    folder, table = bag
    tracks = load_measured(folder / "odom.csv").tracks
    assert len(tracks) == 12
    for trial, (_, rows) in enumerate(table.groupby("trial")):
        driven = tracks.duration_s[trial] * (np.abs(tracks.left_m_s[trial]) > 0)
        given = rows["t_s"].iloc[-1] - rows["t_s"].iloc[0]
        assert driven.sum() == pytest.approx(given, abs=0.05)
    predictor = WheelPredictor(tracks)
    check_same_robot(predictor, NOMINAL)
    errors = paired_errors(predictor, [(m.name, predictor.steps(m)) for m in (SLIPPING, NOMINAL)]).horizons["trial"]
    true, wrong = (m.rms_m for m in errors.models)
    assert true < 0.007
    assert wrong > 2 * true


def test_the_command_line_reads_it_too(bag, capsys):
    folder, _ = bag
    assert main(["import", str(folder / "odom.csv"), "-o", str(folder / "m.parquet")]) == 0
    assert "12 trials" in capsys.readouterr().out
    written = pd.read_parquet(folder / "m.parquet")
    assert written.groupby("trial")["t_s"].first().eq(0).all()
    assert written["session_s"].is_monotonic_increasing


def test_quaternions_of_any_length_and_either_axis_up_are_headings():
    heading, half = np.array([0.3, -2.9, 3.1]), np.array([0.3, -2.9, 3.1]) / 2
    flat = np.zeros(3)
    z_up = pd.DataFrame({"x": flat, "y": flat, "z": 2 * np.sin(half), "w": 2 * np.cos(half)})
    y_up = pd.DataFrame({"x": flat, "y": np.sin(half), "z": flat, "w": np.cos(half)})
    entry = {"from": list("xyzw"), "unit": "quaternion"}
    for table, more in ((z_up, {}), (-z_up, {}), (y_up, {"up": "y"})):
        out = applied(table, {"columns": {"heading_rad": {**entry, **more}}})["heading_rad"]
        np.testing.assert_allclose(np.exp(1j * out), np.exp(1j * heading), atol=1e-12)
    tilted = z_up.assign(x=0.02, y=-0.03)  # a floor that is not quite level hardly turns anything
    assert np.abs(applied(tilted, {"columns": {"heading_rad": entry}})["heading_rad"] - heading).max() < 0.01
    assert applied(0 * z_up, {"columns": {"heading_rad": entry}})["heading_rad"].isna().all()


def test_counters_become_speeds_of_their_trial_alone():
    table = pd.DataFrame({"trial": [0, 0, 0, 1, 1], "t": [0, 100, 300, 0, 50], "ticks": [100, 200, 600, 0, 10]})
    columns = {"left_m_s": {"from": "ticks", "scale": 1e-3, "counts": True}, "t_s": {"from": "t", "unit": "ms"}}
    out = applied(table, {"columns": columns})
    np.testing.assert_allclose(out["left_m_s"], [1.0, 2.0, 2.0, 0.2, 0.2])
    with pytest.raises(DataError, match="a speed needs times"):
        applied(table, {"columns": {"left_m_s": columns["left_m_s"]}})


def test_dates_are_times():
    table = pd.DataFrame({"when": ["2026-05-31T23:59:59.75", "2026-06-01T00:00:00.25"]})
    out = applied(table, {"columns": {"t_s": {"from": "when", "unit": "date"}}})
    assert np.diff(out["t_s"]) == pytest.approx(0.5)
    with pytest.raises(DataError, match="takes unit: date"):
        applied(table, {"columns": {"t_s": {"from": "when"}}})
    with pytest.raises(DataError, match="dates do not read"):
        applied(pd.DataFrame({"when": ["noon"]}), {"columns": {"t_s": {"from": "when", "unit": "date"}}})


def test_commands_are_held_until_the_next_but_no_longer_than_the_watchdog_lets_them():
    table = pd.DataFrame({"t_s": [0.0, 0.1, 0.2, 0.5, 0.6], "left_m_s": [np.nan, 0.1, np.nan, np.nan, 0.2]})
    table["right_m_s"] = table["left_m_s"]
    always = applied(table, {"columns": {}, "hold_commands_s": float("inf")})["left_m_s"]
    assert always.isna().tolist() == [True, False, False, False, False]
    assert always.tolist()[1:] == [0.1, 0.1, 0.1, 0.2]
    watched = applied(table, {"columns": {}, "hold_commands_s": 0.25})["left_m_s"]
    assert watched.isna().tolist() == [True, False, False, True, False]


def test_commands_in_rows_of_their_own_that_nobody_holds_are_asked_for(bag):
    folder, _ = bag
    table = applied(read_table(folder / "odom.csv"), {**ROS, "hold_commands_s": 1e-9}, folder, read_table)
    with pytest.raises(DataError, match=r"hold_commands_s: \.inf"):
        checked(table)


def test_a_long_log_is_cut_where_the_robot_stands_and_a_second_around_is_kept():
    log = continuous(measured(NOMINAL, trials=3))
    out = split(log, "standing_s", 2.0)
    assert out["trial"].nunique() == 3
    for _, rows in out.groupby("trial"):
        moving = rows.loc[rows["left_m_s"].abs() > 0, "t_s"]
        assert moving.iloc[0] == pytest.approx(KEPT_S, abs=0.05)
        assert rows["t_s"].iloc[-1] - moving.iloc[-1] == pytest.approx(KEPT_S, abs=0.1)
    assert out["session_s"].is_monotonic_increasing


def test_a_log_without_stops_is_cut_into_pieces_that_begin_in_motion():
    log = continuous(measured(NOMINAL, trials=4), pause_s=0.2)
    out = split(log, "lasting_s", 5.0)
    own = out[out["run_up"] == 0]
    assert len(own) == len(log)
    assert (own.groupby("trial")["t_s"].first() == 0).all()
    assert own.groupby("trial")["t_s"].last().iloc[:-1].between(4.8, 5.0).all()
    for trial, rows in out[out["trial"] > 0].groupby("trial"):
        ahead = rows[rows["run_up"] == 1]
        assert ahead["t_s"].between(-RUN_UP_S, -1e-9).all()
        assert ahead["x_m"].isna().all()
        there = log["t_s"].searchsorted(ahead["session_s"].to_numpy() - 1e-9)
        assert (ahead["left_m_s"].to_numpy() == log["left_m_s"].to_numpy()[there]).all(), trial


def test_a_time_that_starts_again_with_every_trial_is_told_what_to_do():
    table = pd.DataFrame({"t_s": [0.0, 0.1, 0.0, 0.1], "left_m_s": 0.1, "right_m_s": 0.1})
    with pytest.raises(DataError, match=r"Row 2: t_s runs backwards .* give the log a column trial \(in pandas: .*cumsum"):
        split(table, "gap_s", 1.0)
    assert (table.t_s.diff() < 0).cumsum().tolist() == [0, 0, 1, 1]


def test_gaps_cut_a_log_where_nothing_was_written():
    log = continuous(measured(NOMINAL, trials=3))
    kept = log[(log["left_m_s"].abs() > 0) | (log["right_m_s"].abs() > 0)]
    assert split(kept, "gap_s", 2.0)["trial"].nunique() == 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"trials": {"standing_s": 100}}, "fewer than two trials. The robot stands for 4.* at most.*lasting_s cuts anywhere"),
        ({"wheelbase_m": None}, "add wheelbase_m: METRES"),
        ({"also": []}, "cut into trials, a log needs left_m_s, right_m_s"),
    ],
)
def test_what_does_not_fit_a_log_is_said(bag, tmp_path, change, message):
    folder, _ = bag
    mapping = {k: v for k, v in {**ROS, **change}.items() if v is not None}
    with pytest.raises(DataError, match=message):
        applied(read_table(folder / "odom.csv"), mapping, folder, read_table)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"trials": {"standing_s": -1}}, "trials is .*write one of"),
        ({"trials": {"standing": 1}}, "trials is .*write one of"),
        ({"hold_commands_s": "yes"}, "hold_commands_s is 'yes'; it must be a number above 0"),
        ({"also": {"file": "a.csv"}}, "also is .*must be a list"),
        ({"also": [{"file": "a.csv", "columns": {}}]}, "a.csv needs an entry t_s"),
        ({"also": [{"file": "a.csv", "colums": {}}]}, "write {file: NAME"),
        ({"columns": {"heading_rad": {"from": TURNS}}}, "a quaternion is"),
        ({"columns": {"heading_rad": {"from": "yaw", "up": "y"}}}, "it is for quaternions"),
        ({"columns": {"left_m_s": {"from": "w", "unit": "rad/s"}}}, "scale: its radius in metres"),
        ({"holds": 1}, "unknown key 'holds'"),
    ],
)
def test_mappings_that_are_wrong_say_where(tmp_path, change, message):
    with pytest.raises(DataError, match=message):
        mapped(tmp_path, **change)


@pytest.mark.parametrize(
    ("columns", "drafted_"),
    [
        (
            {"Time (ms)": [0, 40], "yaw_deg": [0, 90], **{f"{name} mm/s": [1, 2] for name in ("vLeft", "vRight")}, **MILLIMETRES},
            {
                "t_s": {"from": "Time (ms)", "unit": "ms"},
                "left_m_s": {"from": "vLeft mm/s", "unit": "mm/s"},
                "right_m_s": {"from": "vRight mm/s", "unit": "mm/s"},
                "x_m": {"from": "X [mm]", "unit": "mm"},
                "y_m": {"from": "Y [mm]", "unit": "mm"},
                "heading_rad": {"from": "yaw_deg", "unit": "deg"},
            },
        ),
        (
            {"stamp": [0, 40_000_000], **{name: [0, 1] for name in (*PLACES, *TURNS, "linear.x", "angular.z")}},
            {**ROS["columns"], "forward_m_s": {"from": "linear.x"}, "turn_rad_s": {"from": "angular.z"}},
        ),
        (
            {"run": ["a", "a"], "when": [0, 1], "timestamp": ["2026-05-31T12:00", "2026-05-31T12:01"], "heading": [10, 350]},
            {
                "trial": {"from": "run"},
                "t_s": {"from": "timestamp", "unit": "date"},
                "heading_rad": {"from": "heading", "unit": "deg"},
            },
        ),
        ({"a1": [0, 1]}, {}),
    ],
)
def test_a_mapping_is_drafted_from_the_names(columns, drafted_):
    draft = yaml.safe_load(guessed(pd.DataFrame(columns)).text)
    assert draft["columns"] == drafted_
    assert ("wheelbase_m" in draft) == ("turn_rad_s" in drafted_)
    assert ("trials" in draft) == ("trial" not in drafted_)


def test_a_log_without_a_mapping_is_answered_with_a_draft(bag, capsys):
    folder, _ = bag
    (folder / "odom.csv.import.yaml").unlink()
    assert main(["import", str(folder / "odom.csv"), "-o", str(folder / "m.csv")]) == 2
    said = capsys.readouterr().err
    assert "check it line by line" in said
    assert "unit: quaternion" in said
    assert not (folder / "m.csv").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("trial,t_s,x_m,x_m\n0,0,1,2\n", r"a\.csv has more than one column x_m; leave out all but one of that name"),
        ('trial,t_s,x_m," x_m "\n0,0,1,2\n', r"a\.csv has more than one column x_m; leave out all but one of that name"),
        ('t_s,x_m\n0,1\n1,2,3,4\n', r"a\.csv does not read as csv: line 3 has 4 columns, and the first line 2; put texts"),
    ],
)
def test_tables_that_are_no_tables_are_refused_in_words(tmp_path, text, message):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(DataError, match=message):
        read_table(tmp_path / "a.csv")


def test_blanks_around_headings_are_none_of_the_names(tmp_path):
    (tmp_path / "a.csv").write_text('trial , t_s," x_m ",y of it\n0,0.5,1,2\n')
    assert list(read_table(tmp_path / "a.csv").columns) == ["trial", "t_s", "x_m", "y of it"]


def test_columns_that_nobody_reads_may_be_there_twice(tmp_path):
    (tmp_path / "a.csv").write_text("t_s,mark,mark\n0,1,2\n")
    assert list(read_table(tmp_path / "a.csv").columns) == ["t_s", "mark", "mark.1"]


@pytest.mark.parametrize("separator", [";", "\t"])
def test_spreadsheets_of_other_countries_are_read(tmp_path, separator):
    table = pd.DataFrame({"a": [1.5, 2.25], "b": [3.0, 4.5]})
    table.to_csv(tmp_path / "a.csv", index=False, sep=separator, decimal=",")
    with gzip.open(tmp_path / "b.csv.gz", "wt") as file:
        table.to_csv(file, index=False, sep=separator)
    for name in ("a.csv", "b.csv.gz"):
        pd.testing.assert_frame_equal(read_table(tmp_path / name), table)


@pytest.mark.parametrize("degrees", [90, -90, 180])
def test_headings_of_another_frame_are_refused_with_the_turn_that_mends_them(degrees):
    table = measured(NOMINAL, trials=6)
    turned = table.assign(heading_rad=table["heading_rad"] - np.radians(degrees))
    with pytest.raises(DataError, match="zero_deg") as refused:
        check_same_robot(WheelPredictor(tracks_of(turned)), NOMINAL)
    told = int(re.search(r"zero_deg: (-?\d+)", str(refused.value))[1])
    assert (told - degrees) % 360 == 0
    check_same_robot(WheelPredictor(tracks_of(table)), NOMINAL)


def test_mirrored_positions_are_refused():
    table = measured(NOMINAL, trials=6)
    with pytest.raises(DataError, match="mirrored"):
        check_same_robot(WheelPredictor(tracks_of(table.assign(y_m=-table["y_m"]))), NOMINAL)


def test_a_camera_that_is_askew_is_left_to_the_diagnosis():
    table = measured(hidden(camera_rotation={"angle_rad": 0.6}), trials=6)
    check_same_robot(WheelPredictor(tracks_of(table)), NOMINAL)


def test_a_short_stand_belongs_by_halves_to_the_drives_before_and_after_it():
    t = np.arange(0.0, 7.0, 0.1).round(1)
    moving = np.where((t >= 3.0) & (t < 4.0), 0.0, 0.1)  # it stands for a second, less than twice what is kept
    assert 2 * KEPT_S > 1.0
    out = split(pd.DataFrame({"t_s": t, "left_m_s": moving, "right_m_s": moving}), "standing_s", 0.8)
    assert out.groupby("trial")["session_s"].agg(["first", "last"]).round(1).to_numpy().tolist() == [[0.0, 3.5], [3.6, 6.9]]


def test_a_piece_brings_along_the_commands_before_it():
    t = np.arange(0.0, 20.5, 0.5)
    out = split(pd.DataFrame({"t_s": t, "left_m_s": 0.1, "right_m_s": t}), "lasting_s", 10.0)
    ahead = out[out["run_up"] == 1]
    assert ahead["trial"].unique().tolist() == [1]
    assert ahead["session_s"].tolist() == t[(t >= 10.0 - RUN_UP_S) & (t < 10.0)].tolist()


def test_a_command_is_in_force_for_as_long_as_the_watchdog_waits_and_no_longer():
    table = pd.DataFrame({"t_s": [0.0, 0.25, 0.5], "left_m_s": [0.1, np.nan, np.nan], "right_m_s": [0.2, np.nan, np.nan]})
    assert held(table, 0.25)["right_m_s"].isna().tolist() == [False, False, True]


def test_poses_before_the_first_command_of_their_own_trial_lack_none():
    told = [0.1, np.nan, np.nan, np.nan, 0.1, 0.1]
    table = pd.DataFrame({"trial": [0, 0, 1, 1, 1, 1], "left_m_s": told, "right_m_s": told})
    table = table.assign(x_m=0.0, y_m=0.0, heading_rad=0.0)
    assert without_commands(table) == pytest.approx(1 / 4)


@pytest.mark.parametrize("degrees", [0.0, 90.0, -90.0, 180.0])
@pytest.mark.parametrize("size", [0.5, 1.0, 3.0])
def test_headings_along_the_axes_are_read_from_quaternions_of_any_length(degrees, size):
    half = np.radians(degrees) / 2
    given = pd.DataFrame({"x": 0.0, "y": 0.0, "z": size * np.sin(half), "w": size * np.cos(half)}, index=range(3))
    np.testing.assert_allclose(np.exp(1j * yaw(given, "z")), np.exp(1j * np.radians(degrees)), atol=1e-12)


def test_long_quaternions_of_a_robot_on_its_side_are_refused():
    half = np.radians(70.0) / 2
    with pytest.raises(DataError, match="is 70 degrees off up"):
        yaw(pd.DataFrame({"x": 2 * np.sin(half), "y": 0.0, "z": 0.0, "w": 2 * np.cos(half)}, index=range(3)), "z")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda t: t.assign(left_m_s=t["right_m_s"], right_m_s=t["left_m_s"]), "left_m_s and right_m_s are exchanged"),
        (lambda t: t.assign(heading_rad=-t["heading_rad"]), "give it clockwise: true"),
        (lambda t: t.assign(left_m_s=-t["left_m_s"], right_m_s=-t["right_m_s"]), "the signs of both wheels are reversed"),
        (lambda t: t.assign(y_m=-t["y_m"], heading_rad=-t["heading_rad"]), "positions and headings are both mirrored"),
        (lambda t: t.assign(x_m=t["x_m"].to_numpy()[::-1], heading_rad=-t["heading_rad"]), "or the signs of both wheels"),
    ],
)  # fmt: skip
def test_a_robot_that_turns_opposite_to_its_wheels_is_told_the_one_cause(wrong, said):
    """Whether path and headings belong together tells exchanged wheels from headings that run clockwise."""
    table = wrong(measured(NOMINAL, trials=12))
    trials = [(str(name), rows.to_numpy()) for name, rows in table.reset_index(drop=True).groupby("trial").groups.items()]
    with pytest.raises(DataError, match="turns opposite to the wheels") as refused:
        check_units(table.reset_index(drop=True), trials)
    assert said in str(refused.value)
    assert ("exchanged" in str(refused.value)) == (said != "give it clockwise: true")
