"""Data that are odd are named, with trial and row; data that would mislead are refused."""

import json

import numpy as np
import pandas as pd
import pytest

from bns.api.add import add
from bns.api.compare import compare
from bns.api.measurements import Measurements
from bns.api.model import Model
from bns.diagnose.data.checks import checked
from bns.diagnose.data.load import _tracks, load_measured
from bns.diagnose.data.still_heading import _turned_m
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.data.units import _check_length, check_units
from bns.diagnose.report.text import findings_text
from bns.errors import DataError
from tests.diagnose.worlds import NOMINAL, measured

NOMINAL_MODEL = Model(NOMINAL)


@pytest.fixture(scope="module")
def table():
    return measured(NOMINAL, trials=3)


def test_good_data_pass_as_they_are(table):
    usable, findings = checked(table)
    assert findings == []
    pd.testing.assert_frame_equal(usable, table.reset_index(drop=True), check_dtype=False)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: {"x_m": t.x_m * 100, "y_m": t.y_m * 100}, "look like centimetres; .* unit: cm}"),
        (lambda t: {"x_m": t.x_m * 1000, "y_m": t.y_m * 1000}, "look like millimetres"),
        (lambda t: {"heading_rad": np.degrees(t.heading_rad)}, "looks like degrees; .* LOG.import.yaml .* unit: deg}"),
        (lambda t: {"t_s": t.t_s * 1000}, "t_s looks like milliseconds; .* unit: ms}"),
        (lambda t: {"t_s": t.t_s * 1e9}, "t_s looks like nanoseconds; .* unit: ns}"),
        (lambda t: {"heading_rad": -t.heading_rad}, "counter-clockwise"),
        (lambda t: {"left_m_s": -t.left_m_s, "right_m_s": -t.right_m_s}, "signs of both wheels are reversed"),
        (lambda t: {"x_m": t.x_m / 0.0254, "y_m": t.y_m / 0.0254}, "look like inches; .* unit: in}"),
        (lambda t: {"left_m_s": t.left_m_s / 0.0254, "right_m_s": t.right_m_s / 0.0254}, "in/s, or a device's .* or unit: in/s"),
        (lambda t: {"left_m_s": np.nan}, "left_m_s is empty in all rows: no command is ever in force"),
        (lambda t: {"left_m_s": np.nan, "right_m_s": np.nan}, "left_m_s and right_m_s are empty in all rows"),
        (
            lambda t: {"left_m_s": t.left_m_s.where(t.index % 2 == 0), "right_m_s": t.right_m_s.where(t.index % 2 == 1)},
            "No row has a value in both left_m_s and right_m_s",
        ),
        (lambda t: {"left_m_s": 0.0, "right_m_s": 0.0}, "All values of left_m_s and right_m_s are 0, but the robot moves"),
        (lambda t: {"heading_rad": 0.0}, "heading_rad is 0 in all poses, although the commands turn the robot"),
        (lambda t: {"heading_rad": np.where(t.index % 2, np.pi, -np.pi)}, "in all poses, although the commands turn"),
        (lambda t: {"left_m_s": t.left_m_s * 100, "right_m_s": t.right_m_s * 100}, r"look like cm/s; .* unit: cm/s"),
        (lambda t: {"left_m_s": t.left_m_s * 50, "right_m_s": t.right_m_s * 50}, "rad/s of wheels with a radius of 20 mm"),
        (lambda t: {"left_m_s": t.left_m_s * 1000, "right_m_s": t.right_m_s * 1000}, "look like mm/s"),
        (lambda t: {"x_m": np.nan}, "no tracked pose"),
        (lambda t: {"y_m": "here"}, r"Row 0: y_m is 'here'; it must be a number"),
        (lambda t: {"t_s": t.t_s.where(t.index != 7)}, r"Row 7: t_s is empty"),
        (lambda t: {"x_m": t.x_m.where(t.index != 5, np.inf)}, r"Row 5: x_m is infinite"),
        (lambda t: {"t_s": t.t_s[::-1].to_numpy()}, "time runs backwards"),
    ],
)
def test_misleading_data_are_refused(table, change, message):
    with pytest.raises(DataError, match=message):
        checked(table.assign(**change(table)))


def test_a_message_names_the_mapping_of_the_log_that_it_is_about(table, tmp_path):
    """Only who reads the file knows its name."""
    path = tmp_path / "half.csv"
    table.assign(t_s=table["t_s"] * 1000).to_csv(path, index=False)
    with pytest.raises(DataError, match=r"half\.csv: .* mapping half\.csv\.import\.yaml"):
        load_measured(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x_m": 10.0}, "Along x_m the robot goes .* as far as along y_m, .*different units, as cm and mm are"),
        ({"x_m": 0.1}, "Along y_m the robot goes .* as far as along x_m, .*different units, as cm and mm are"),
        ({"x_m": 1000.0}, "units, as m and mm are.*give x_m and y_m the same `unit` and `scale`"),
        ({"y_m": 2.54}, "different units, as in and cm are"),
        ({"x_m": 100.0, "y_m": 1000.0}, "different units, as cm and mm are"),
    ],
)
@pytest.mark.parametrize("turned", [0.0, 1.0])
def test_x_and_y_in_different_units_are_said_before_any_advice_on_speeds(table, change, message, turned):
    scaled = {name: factor * table[name] for name, factor in change.items()} | {"heading_rad": table.heading_rad + turned}
    with pytest.raises(DataError, match=message):
        checked(table.assign(**scaled))


def test_axes_of_one_unit_pass_however_the_frame_lies(table):
    def said(**change):
        try:
            checked(table.assign(**change))
        except DataError as fault:
            return str(fault)
        return ""

    for change in ({"heading_rad": table.heading_rad + 1.0}, {"x_m": table.y_m, "y_m": table.x_m}, {"x_m": 1.6 * table.x_m}):
        assert "different units" not in said(**change)
    along = 0.04 * table.left_m_s.groupby(table.trial).cumsum()  # in one direction, which the heading does not tell
    assert "different units" not in said(x_m=along, y_m=0.1 * along, heading_rad=1.0, right_m_s=table.left_m_s)


def test_a_robot_that_is_stuck_has_no_commands_in_another_unit(table):
    rng = np.random.default_rng(4)
    stuck = table.assign(x_m=0.1 + 0.002 * rng.normal(size=len(table)), y_m=0.002 * rng.normal(size=len(table)))
    assert len(checked(stuck)[0]) == len(table)
    for alike in (stuck.iloc[:40], stuck.assign(left_m_s=0.1, right_m_s=0.1)):  # a single window; windows that are all the same
        assert len(checked(alike)[0]) == len(alike)


@pytest.mark.parametrize(("column", "told"), [("left_m_s", 1), ("right_m_s", 1)])
def test_a_command_for_one_wheel_only_is_listed(table, column, told):
    half = table.assign(**{column: table[column].where(table.index % 3 != told)})
    assert any("a command for one wheel only" in f.text and f"({column} is empty)" in f.text for f in checked(half)[1])
    both = table.assign(left_m_s=half[column], right_m_s=half[column])
    assert not any("one wheel only" in f.text for f in checked(both)[1])


def without_commands_in(table, *names):
    empty = table.trial.isin(names)
    return table.assign(**{name: table[name].mask(empty) for name in ("left_m_s", "right_m_s")})


def test_trials_without_a_command_say_what_is_done_with_them_and_how_to_leave_them_out(table):
    odd = without_commands_in(table, 1)
    (found,) = checked(odd)[1]
    assert (found.trial, found.row) == ("1", int(table.index[table.trial == 1][0]))
    assert "this trial holds no command from beginning to end, and the robot counts as told to stand" in found.text
    assert "it moves, which counts as an error of every model and in every fit" in found.text
    assert found.text.endswith("leave it out: --without 1 (in Python: log.without(['1']))")
    assert tracks_of(checked(odd)[0]).left_m_s[1].tolist() == [0.0] * tracks_of(odd).left_m_s.shape[1]  # as the words say
    (found,) = checked(without_commands_in(measured(NOMINAL, trials=9), *range(7)))[1]
    assert "7 trials hold no command" in found.text
    assert "In 7 of them it moves" in found.text
    assert found.text.endswith("'4'])), and so on for 2 more")
    left = Measurements(without_commands_in(table, 1)).without(["1"])
    assert left.findings.empty


def test_a_robot_that_stands_without_a_command_tells_the_noise(table):
    odd = without_commands_in(table, 1)
    odd.loc[odd.trial == 1, ["x_m", "y_m", "heading_rad"]] = [0.1, 0.2, 0.3]
    (found,) = checked(odd)[1]
    assert "It does stand: the poses are used for the noise of the tracker" in found.text


def test_missing_columns_are_named(table):
    with pytest.raises(DataError, match=r"lack heading_rad; they have trial, t_s.*bns import"):
        checked(table.drop(columns="heading_rad"))
    with pytest.raises(DataError, match="no rows"):
        checked(table.iloc[:0])
    with pytest.raises(DataError, match=r"lack trial; they have trial in the index \(`table.reset_index\(\)`.*\), and t_s, l"):
        checked(table.set_index("trial"))
    with pytest.raises(DataError, match="they have no columns"):
        checked(pd.DataFrame())


def test_a_column_that_is_there_twice_is_refused(table):
    with pytest.raises(DataError, match="more than one column x_m; leave out all but one"):
        checked(pd.concat([table, table[["x_m"]]], axis=1))


@pytest.mark.parametrize(("row", "t_s", "said"), [(5, 1e3, "lies after that of later"), (6, -1.0, "lies before an earlier one")])
def test_one_wrong_time_costs_one_row(table, row, t_s, said):
    """One that lies ahead used to cost all rows up to it."""
    changed = table.assign(t_s=table.t_s.where(table.index != row, t_s))
    usable, findings = checked(changed)
    assert len(usable) == len(table) - 1
    assert [f.row for f in findings if said in f.text] == [row]


def test_poses_of_no_trial_are_said_to_be_left_out(table):
    usable, findings = checked(table.assign(trial=table.trial.where(table.index >= 20)))
    assert len(usable) == len(table) - 20
    assert [(f.trial, f.row) for f in findings if "20 poses belong to no trial" in f.text] == [("", 0)]
    assert "\n  row 0: 20 poses belong" in findings_text(tuple(findings))


@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_times_may_be_dates_or_differences(table, zone):
    since = pd.to_timedelta(table.t_s, unit="s")
    expected = tracks_of(checked(table)[0])
    for times in (since, pd.Timestamp("2026-11-26 12:00", tz=zone) + since):
        tracks = tracks_of(checked(table.assign(t_s=times))[0])
        np.testing.assert_allclose(tracks.t_s, expected.t_s, atol=1e-9)


@pytest.mark.parametrize("unit", ["ns", "s"])
def test_dates_are_no_numbers_in_a_unit(table, unit):
    dates = table.assign(t_s=pd.Timestamp("2026-11-26") + pd.to_timedelta(table.t_s, unit="s"))
    rules = {"columns": {name: {"from": name} for name in table.columns} | {"t_s": {"from": "t_s", "unit": unit}}}
    with pytest.raises(DataError, match=r"t_s, which holds Timestamp.*no number; a date and time of day takes unit: date"):
        Measurements(dates, mapping=rules)


def test_noise_of_a_robot_that_never_stands_is_called_a_lower_bound(table):
    rest = measured(NOMINAL, trials=1).assign(left_m_s=0.0, right_m_s=0.0, trial="rest")
    rest[["x_m", "y_m", "heading_rad"]] = np.random.default_rng(0).normal(0, 1e-3, (len(rest), 3))
    standing = pd.concat([table, rest], ignore_index=True)
    for log, said in ((table, True), (standing, False)):
        assert (", at least; the scatter of the drive" in compare(log, NOMINAL_MODEL).summary()) == said
        assert ("alone causes; at least " in add(log, "motor-lag", NOMINAL_MODEL).summary()) == said


def test_one_trial_has_no_standard_error_and_holds_nothing_out(table):
    alone = table[table.trial == table.trial.iloc[0]]
    compared = compare(alone, NOMINAL_MODEL)
    assert compared.errors.position_se_m.isna().all()
    plain = json.loads(json.dumps(compared.to_json(), allow_nan=False))["error"]
    assert {of["position_se_m"] for of in plain.values()} == {None}
    assert plain["trial"]["windows"] == 1
    assert compare(table, NOMINAL_MODEL).errors.position_se_m.gt(0).all()
    added = add(alone, "motor-lag", NOMINAL_MODEL)
    assert "position error on the one trial, to which the numbers were fitted (none is held out)" in added.summary()
    assert any(warning.startswith("there is one trial") for warning in added.warnings)
    assert not any("does not fall" in warning for warning in added.warnings)


def test_jumps_are_found_also_in_pairs_and_at_the_ends(table):
    broken = table.copy()
    rows = [0, 40, 41, 90]
    broken.loc[rows, "x_m"] += [0.3, 0.25, -0.4, 0.2]
    usable, findings = checked(broken)
    assert sorted(f.row for f in findings if "jumps" in f.text) == rows
    assert usable.loc[rows, "x_m"].isna().all()
    assert usable["x_m"].isna().sum() == len(rows)


@pytest.mark.parametrize("off_m", np.linspace(0.1, 0.4, 7))
def test_a_first_or_last_pose_that_is_wrong_is_lost_and_not_the_trial(table, off_m):
    """The line from it to the next but one puts the sound pose between them as far off, but for noise."""
    broken = table.copy()
    ends = [row for _, rows in table.groupby("trial") for row in (rows.index[0], rows.index[-1])]
    broken.loc[ends, "y_m"] += off_m
    assert sorted(f.row for f in checked(broken)[1] if "jumps" in f.text) == sorted(ends)
    assert len(_tracks(broken)[0].t_s) == len(table) - len(ends)


def test_a_pose_that_is_held_and_catches_up_is_no_jump(table):
    held = table.copy()
    columns = ["x_m", "y_m", "heading_rad"]
    for _, rows in held.groupby("trial"):
        held.loc[rows.index, columns] = rows[columns].iloc[np.arange(len(rows)) // 5 * 5].to_numpy()
    assert not [f for f in checked(held)[1] if "jumps" in f.text]


def test_gaps_repeats_and_losses_are_listed(table):
    first = table[table.trial == 0]
    odd = pd.concat([first.iloc[:20], first.iloc[19:40], first.iloc[60:], table[table.trial != 0]], ignore_index=True)
    odd.loc[5:8, "x_m"] = np.nan
    usable, findings = checked(odd)
    texts = [f.text for f in findings if f.trial == "0"]
    assert any("repeats an earlier one; the row is excluded" in text for text in texts)
    assert any("no row for 0.84 s" in text for text in texts)
    assert any("4 poses lost" in text for text in texts)
    assert len(usable) == len(odd) - 1


def test_findings_of_a_trial_are_in_the_order_of_its_rows(table):
    odd = table.copy()
    odd.loc[30, "x_m"] += 0.3
    odd.loc[[10, 11], "x_m"] = np.nan  # losses are counted after jumps, which are taken for lost
    found = [f for f in checked(odd)[1] if f.trial == "0"]
    assert [(f.row, "jumps" in f.text) for f in found] == [(10, False), (30, True)]


@pytest.mark.parametrize("pose_first", [True, False])
def test_a_pose_and_a_command_of_one_time_are_one_row(table, pose_first):
    one = table[table.trial == 0].reset_index(drop=True)
    changes = one.index[one.left_m_s.ne(one.left_m_s.shift()) & (one.index > 0) & one.left_m_s.notna()]
    told, seen = one.loc[changes].copy(), one.copy()
    told[["x_m", "y_m", "heading_rad"]] = np.nan
    wheels = ["left_m_s", "right_m_s"]
    if pose_first:  # which was taken under the command before
        seen.loc[changes, wheels] = one.loc[changes - 1, wheels].to_numpy()
    else:
        seen.loc[changes, wheels] = np.nan
    logged = pd.concat([seen, told] if pose_first else [told, seen]).sort_values("t_s", kind="stable", ignore_index=True)
    usable, findings = checked(logged)
    assert findings == []
    pd.testing.assert_frame_equal(usable.reset_index(drop=True), one, check_dtype=False)


def test_tracks_hold_commands_as_they_were_in_force(table):
    tracks = tracks_of(table)
    assert len(tracks) == 3
    assert tracks.first[-1] == len(table)
    first = table[table.trial == 0]
    assert tracks.duration_s[0].sum() == pytest.approx(first.t_s.iloc[-1])
    assert tracks.left_m_s[0, 0] == first.left_m_s.iloc[0]
    assert tracks.start_s[1] == pytest.approx(first.t_s.iloc[-1])
    assert not tracks.start_known
    known = tracks_of(table.assign(session_s=table.t_s + 100 * table.trial))
    np.testing.assert_allclose(known.start_s, [0, 100, 200])
    some = tracks.only(np.array([2, 0]))
    assert some.names == ("2", "0")
    np.testing.assert_array_equal(some.pose[: some.first[1]], tracks.pose[tracks.first[2] :])


@pytest.mark.parametrize("gone", [0, 1, 2])
def test_a_trial_without_a_tracked_pose_is_left_out_and_said_to_be(table, gone):
    usable, findings = checked(table.assign(x_m=table.x_m.where(table.trial != gone)))
    assert [f.trial for f in findings if "the trial is excluded" in f.text] == [str(gone)]
    assert len(tracks_of(usable)) == 2
    assert gone not in set(usable.trial)


def test_turns_of_more_than_half_a_round_between_two_poses_are_not_held_against_the_wheels():
    lasts = np.tile([0.4, 0.8, 2.0, 2.2], 10)
    turned = np.cumsum(np.append(0.0, 2.1 * lasts))
    pose = {"x_m": 0.0, "y_m": 0.0, "heading_rad": np.angle(np.exp(1j * turned))}
    speeds = {"left_m_s": np.append(np.full(40, 0.02), np.nan), "right_m_s": np.append(np.full(40, 0.206), np.nan)}
    table = pd.DataFrame({"trial": 0, "t_s": np.cumsum(np.append(0.0, lasts)), **speeds, **pose})
    checked(table.assign(x_m=0.02 * np.arange(41), y_m=1e-9 * np.arange(41)))


def test_minutes_are_told_from_inches_and_degrees():
    good = measured(NOMINAL, trials=6, seed=3)
    with pytest.raises(DataError, match="t_s looks like minutes"):
        checked(good.assign(t_s=good.t_s / 60))
    inches, degrees = "x_m and y_m look like inches", "heading_rad looks like degrees"
    for size, turn, text in ((39.37, 1, inches), (55, 1, inches), (39.37, 57.3, inches), (1, 57.3, degrees)):
        other = good.assign(x_m=good.x_m * size, y_m=good.y_m * size, heading_rad=good.heading_rad * turn)
        with pytest.raises(DataError, match=text):
            checked(other)


def test_a_robot_at_rest_that_was_told_nothing_is_listed(table):
    rng = np.random.default_rng(5)
    still = {name: 0.1 + 0.002 * rng.normal(size=len(table)) for name in ("x_m", "y_m", "heading_rad")}
    _, findings = checked(table.assign(left_m_s=0.0, right_m_s=0.0, **still))
    assert any("the robot was never told to move" in finding.text for finding in findings)


def test_a_heading_that_stays_is_right_where_nothing_turns_the_robot(table):
    straight = table.assign(right_m_s=table.left_m_s, heading_rad=0.0)
    assert len(checked(straight)[0]) == len(table)


@pytest.mark.parametrize(("name", "other"), [("x_m", "y_m"), ("y_m", "x_m")])
def test_a_coordinate_that_never_changes_while_the_robot_drives_along_it_is_none(table, name, other):
    with pytest.raises(DataError, match=rf"^{name} is 1 in all poses, although {other} changes and the robot drives up to \d"):
        checked(table.assign(**{name: 1.0}))


def test_a_coordinate_that_stays_is_right_where_the_robot_drives_along_the_other(table):
    straight = table.assign(right_m_s=table.left_m_s, heading_rad=np.pi / 2, x_m=1.0)
    assert len(checked(straight)[0]) == len(table)
    rest = table.assign(left_m_s=0.0, right_m_s=0.0, heading_rad=0.3, x_m=1.0, y_m=2.0)
    assert len(checked(rest)[0]) == len(table)


def test_rows_that_were_written_twice_are_one_finding_of_a_trial_and_no_slow_tracker(table):
    twice = pd.concat([table, table]).sort_values(["trial", "t_s"], kind="stable", ignore_index=True)
    usable, findings = checked(twice)
    assert len(usable) == len(table)
    assert [finding.trial for finding in findings] == ["0", "1", "2"]
    rows = int((table.trial == 0).sum())
    assert findings[0].text == f"in {rows} rows, the first here (time 0 s), the time repeats an earlier one; they are excluded"
    assert findings[0].row == 1


def test_a_robot_that_is_turned_and_turned_back_was_turned():
    rows = pd.DataFrame({"t_s": [0.0, 1.0, 3.0, 4.0], "left_m_s": 0.0, "right_m_s": [0.1, 0.2, -0.5, 9.0]})
    assert _turned_m(rows) == pytest.approx(0.5)
    assert _turned_m(rows.assign(right_m_s=[np.nan, 0.2, -0.4, 0.0])) == pytest.approx(0.4)


def test_one_trial_that_lasts_too_long_is_named_whatever_the_others_do():
    table = pd.DataFrame({"trial": ["a", "a", "b", "b"], "t_s": [0.0, 1.0, 0.0, 2e6]})
    with pytest.raises(DataError, match="Trial b lasts 2e\\+06 s"):
        _check_length(table)


def test_milliseconds_of_a_fast_tracker_are_known_by_how_far_the_robot_went():
    rows = np.arange(800.0)  # at 200 Hz: the pauses between rows alone might be seconds
    table = pd.DataFrame({"trial": "0", "t_s": 5.0 * rows, "left_m_s": 0.1, "right_m_s": 0.1, "x_m": 0.0005 * rows})
    table = table.assign(y_m=0.0, heading_rad=0.0)
    with pytest.raises(DataError, match="Successive rows are 5 s apart: t_s looks like milliseconds"):
        check_units(table, [("0", np.arange(800))])
