"""What the menus for columns and units make of a mapping, and the preview of what would be read."""

import numpy as np
import pandas as pd
import pytest

import bns
from bns.app.html import table as html_table
from bns.app.log import roles
from bns.app.log.columns import ColumnsPart
from bns.app.log.preview import preview
from bns.app.log.roles import BODY, COUNTED, FROM_NORTH, FROM_X, ROLES, TURNS, WHEELS, Menus
from bns.diagnose.data.guess.mapping import guessed
from bns.diagnose.data.guess.numbers import metres_a_unit
from bns.diagnose.data.mapping import FORWARD, TURN
from bns.diagnose.data.sources.read import read_table
from bns.examples import FOLDER

LOG = FOLDER / "khepera-log.csv"


@pytest.fixture(scope="module")
def table():
    return read_table(LOG)


@pytest.fixture(scope="module")
def menus(table):
    return Menus({"": table})


def test_the_menus_begin_with_the_guess_of_bns_import(menus, table):
    assert menus.guess.mapping == guessed(table).mapping
    said = {role: picked for role in ROLES if (picked := roles.picked(menus.guess.mapping, role))}
    assert {role: picked.place[1] for role, picked in said.items()} == {
        "t_s": "time_ms",
        "left_m_s": "left_mm_s",
        "right_m_s": "right_mm_s",
        "x_m": "x_mm",
        "y_m": "y_mm",
        "heading_rad": "compass_deg",
    }
    assert {role: said[role].unit for role in ("t_s", "x_m", "heading_rad")} == {"t_s": "ms", "x_m": "mm", "heading_rad": "deg"}
    assert set(menus.columns("x_m")) == set(map(str, table.columns))


def test_the_choices_of_the_menus_read_the_log_as_its_mapping_file_does(menus):
    mapping = menus.guess.mapping
    mapping = menus.with_column(mapping, "trial", ("", "drive"))
    mapping = roles.with_running(mapping, FROM_NORTH)
    assert bns.Measurements(LOG, mapping=mapping).sha256 == bns.Measurements(LOG).sha256
    assert roles.running(mapping) == FROM_NORTH
    assert roles.running(roles.with_running(mapping, FROM_X)) == FROM_X


def test_a_preview_shows_paths_that_are_mistaken_beside_the_librarys_message(menus, table):
    mapping = roles.with_running(menus.with_column(menus.guess.mapping, "trial", ("", "drive")), FROM_NORTH)
    good = preview({"": table}, mapping)
    assert good
    assert "14 trials" in good.said
    wrong = preview({"": table}, roles.with_unit(roles.with_unit(mapping, "x_m", "m"), "y_m", "m"))
    assert "look like millimetres" in wrong.problem
    assert np.allclose(wrong.paths[0], 1000 * good.paths[0][: len(wrong.paths[0])])
    lacking = preview({"": table}, menus.with_column(mapping, "heading_rad", None))
    assert "heading_rad" in lacking.problem
    assert len(lacking.paths[0])
    uncut = preview({"": table}, menus.guess.mapping)
    assert "runs backwards" in uncut.problem
    assert len(uncut.paths) == 1
    unknown = preview({"": table}, {"columns": {"t_s": {"from": "nothing"}}})
    assert "nothing" in unknown.problem
    assert unknown.paths == ()


def test_another_column_comes_in_the_unit_that_its_name_tells(menus):
    table = menus.tables[""].assign(place_cm=1.0, yaw_deg=0.0)
    more = Menus({"": table})
    mapping = more.with_column(more.guess.mapping, "x_m", ("", "place_cm"))
    assert mapping["columns"]["x_m"] == {"from": "place_cm", "unit": "cm"}
    assert roles.picked(roles.with_unit(mapping, "x_m", "m"), "x_m").unit == "m"
    assert roles.with_unit(mapping, "x_m", "m")["columns"]["x_m"] == {"from": "place_cm"}


def test_a_number_that_is_missing_is_asked_for_by_the_name_of_its_field(menus):
    mapping = menus.guess.mapping
    for role in ("left_m_s", "right_m_s"):
        mapping = roles.with_unit(mapping, role, TURNS)
    part = ColumnsPart(lambda _mapping: None)
    part.show(menus, mapping, "log.csv", FOLDER)
    said = "Fill in the field Radius of the wheels (m) (scale in the entries left_m_s and right_m_s of the mapping): the radius "
    assert f"{said}of the wheels in metres; their speeds are in rad/s." in str(part._problem.view.object)
    part.show(menus, roles.with_wheel_scale(mapping, 0.042), "log.csv", FOLDER)
    assert "Fill in" not in str(part._problem.view.object)


def test_placeholders_are_named_by_their_fields_and_say_what_to_measure(table):
    speeds = {"left_mm_s": "linear_velocity", "right_mm_s": "angular_velocity"}
    menus = Menus({"": table.rename(columns=speeds)})
    mapping = {**menus.guess.mapping, "columns": dict(menus.guess.mapping["columns"])}
    mapping["columns"] |= {FORWARD: {"from": "linear_velocity"}, TURN: {"from": "angular_velocity"}}
    part = ColumnsPart(lambda _mapping: None)
    part.show(menus, None, "log.csv", FOLDER)
    assert "METRES" not in str(part._remarks.object)  # a word of the mapping file, which the page hides
    part.show(menus, {**mapping, "wheelbase_m": "METRES"}, "log.csv", FOLDER)
    said = str(part._problem.view.object)
    assert "Fill in the field Wheelbase of the controller (m) (wheelbase_m of the mapping): the distance in metres" in said
    part.show(menus, {**mapping, "wheelbase_m": 0.1}, "log.csv", FOLDER)
    assert "Fill in" not in str(part._problem.view.object)


def test_a_device_unit_asks_for_its_speed_and_says_how_far_the_robot_went(table):
    menus = Menus({"": table.assign(left_mm_s=table.left_mm_s * 37.0, right_mm_s=table.right_mm_s * 37.0)})
    menus = Menus({"": menus.tables[""].rename(columns={"left_mm_s": "left", "right_mm_s": "right"})})
    part = ColumnsPart(lambda _mapping: None)
    part.show(menus, None, "log.csv", FOLDER)
    said = str(part._problem.view.object)
    went = metres_a_unit(menus.tables[""], menus.guess.mapping["columns"])
    assert went < 1e-4
    assert "Fill in the field Speed of one unit of the commands (m/s) (scale in the entries left_m_s and right_m_s of" in said
    assert f"the robot went about {went:.2g} m per unit and second" in said


def test_wheels_that_were_measured_are_not_called_commanded(table):
    renamed = table.rename(columns={"left_mm_s": "odom_left_mm_s", "right_mm_s": "odom_right_mm_s"})
    mapping = Menus({"": renamed}).guess.mapping
    assert roles.label(mapping, "left_m_s") == "Left wheel, measured"
    assert roles.label(Menus({"": table}).guess.mapping, "left_m_s") == "Left wheel, commanded"


def test_wheels_in_radians_or_counts_ask_for_the_number_that_no_log_tells(menus):
    mapping = menus.guess.mapping
    for role in ("left_m_s", "right_m_s"):
        mapping = roles.with_unit(mapping, role, TURNS)
    assert roles.wheel_scale(mapping) is None
    assert "RADIUS_M" in preview(menus.tables, mapping).problem
    mapping = roles.with_wheel_scale(mapping, 0.042)
    assert roles.wheel_scale(mapping) == 0.042
    assert mapping["columns"]["left_m_s"] == {"from": "left_mm_s", "scale": 0.042}
    counted = roles.with_unit(mapping, "left_m_s", COUNTED)
    assert counted["columns"]["left_m_s"] == {"from": "left_mm_s", "scale": 0.042, "counts": True}
    assert roles.picked(counted, "left_m_s").unit == COUNTED
    assert roles.with_unit(counted, "left_m_s", "mm/s")["columns"]["left_m_s"] == {"from": "left_mm_s", "unit": "mm/s"}


def test_commands_of_the_body_and_cuts_into_trials_change_places(menus):
    mapping = menus.guess.mapping
    assert roles.commanded(mapping) == WHEELS
    for role in ("left_m_s", "right_m_s"):
        mapping = menus.with_column(mapping, role, None)
    for role in (FORWARD, TURN):
        mapping = menus.with_column(mapping, role, ("", "left_mm_s"))
    assert roles.commanded(mapping) == BODY
    cut = roles.with_cut(mapping, "gap_s", 2.0)
    assert cut["trials"] == {"gap_s": 2.0}
    assert "trial" not in cut["columns"]
    assert "trials" not in menus.with_column(cut, "trial", ("", "drive"))


def test_columns_of_a_second_file_are_joined_by_its_time():
    t = np.arange(0, 20, 0.1)
    poses = pd.DataFrame({"time": t, "x": 0.1 * t, "y": 0.0 * t, "theta": 0.0 * t})
    told = pd.DataFrame({"time": t, "cmd_left": 0.1 + 0 * t, "cmd_right": 0.1 + 0 * t})
    menus = Menus({"": poses, "cmd.csv": told})
    mapping = menus.guess.mapping
    assert roles.picked(mapping, "left_m_s").place == ("cmd.csv", "cmd_left")
    exchanged = menus.with_column(mapping, "left_m_s", ("cmd.csv", "cmd_right"))
    assert exchanged["also"][0]["columns"]["t_s"] == {"from": "time"}
    assert roles.picked(exchanged, "left_m_s").place == ("cmd.csv", "cmd_right")
    alone = roles.without_role(roles.without_role(mapping, "left_m_s"), "right_m_s")
    assert "also" not in alone
    again = menus.with_column(alone, "right_m_s", ("cmd.csv", "cmd_right"))
    assert again["also"] == [{"file": "cmd.csv", "columns": {"t_s": {"from": "time"}, "right_m_s": {"from": "cmd_right"}}}]


def test_a_quaternion_is_one_choice_for_the_heading():
    names = {f"pose.orientation.{axis}": 0.0 for axis in "xyzw"}
    menus = Menus({"": pd.DataFrame({"t": [0.0], "x": [0.0], "y": [0.0], **{n: [v] for n, v in names.items()}})})
    four = tuple(names)
    assert f"quaternion {', '.join(four)}" in menus.columns("heading_rad")
    mapping = menus.with_column(menus.guess.mapping, "heading_rad", ("", four))
    assert mapping["columns"]["heading_rad"] == {"from": list(four), "unit": "quaternion"}
    assert roles.picked(mapping, "heading_rad").place == ("", four)


def test_numbers_in_a_table_are_not_broken_at_their_hyphens():
    text = html_table(["effect", "p"], [["motor-lag", "5e-05"], ["turn-slip", "0.05"]])
    assert '<td class="bns-number">5e-05</td>' in text
    assert "<td>0.05</td>" in text
