"""Positions far from the origin of their frame: refused with the offsets that cure it, and proposed with them."""

import numpy as np
import pandas as pd
import pytest
import yaml

from bns.app.log.preview import preview
from bns.app.log.roles import Menus
from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.checks import checked
from bns.diagnose.data.far_origin import offsets_towards_origin
from bns.diagnose.data.guess.mapping import guessed
from bns.diagnose.data.import_log import import_log
from bns.errors import DataError
from tests.diagnose.worlds import NOMINAL, measured

EAST, NORTH = 455_000, 5_812_000
TABLE = measured(NOMINAL, trials=3)


def moved(east=EAST, north=NORTH):
    return TABLE.assign(x_m=TABLE.x_m + east, y_m=TABLE.y_m + north)


def test_positions_of_a_map_are_refused_with_the_offsets_to_paste():
    with pytest.raises(DataError, match="as on a map") as refused:
        checked(moved())
    said = str(refused.value)
    assert "lie 5829783 m from the origin (x_m is about 455000, y_m about 5812000)" in said
    assert "They may lie 1000 m from it, or as far as the robot drives" in said
    assert 'In pandas: table["x_m"] -= 455000; table["y_m"] -= 5812000.' in said
    pasted = yaml.safe_load(said.split("`")[3])
    usable, _ = checked(applied(moved(), pasted))
    np.testing.assert_allclose(usable[["x_m", "y_m"]], checked(TABLE)[0][["x_m", "y_m"]], atol=1e-6)


@pytest.mark.parametrize(("east", "north", "refused"), [(900, 0, False), (1100, 0, True), (-1100, 0.2, True), (800, -800, True)])
def test_what_a_tracker_or_a_field_has_is_near_enough(east, north, refused):
    if not refused:
        checked(moved(east, north))
        return
    with pytest.raises(DataError, match="from the origin") as said:
        checked(moved(east, north))
    assert ("y_m: {" in str(said.value)) == (north == -800)  # an axis that is near needs no offset
    assert ('table["x_m"] += ' in str(said.value)) == (east < 0)


def test_a_robot_may_be_as_far_off_as_it_drives():
    far = np.linspace(0.0, 10_600.0, 50)
    assert offsets_towards_origin(np.column_stack([far, far])) == (0, 0)
    assert offsets_towards_origin(np.column_stack([far + 90_000.0, far / 2.0])) == (-100_000, 0)
    assert offsets_towards_origin(np.full((3, 2), np.nan)) == (0, 0)


def test_offsets_are_as_round_as_the_way_is_wide():
    """Or to ten metres, where it is narrower."""
    near = np.array([[-0.3, 0.1], [0.2, -0.4], [0.1, 0.2]])
    there = np.array([455_237.0, -61.0])
    assert offsets_towards_origin(there + near) == (-455_240, 60)
    assert offsets_towards_origin(there + 100 * near) == (-455_200, 100)


def test_a_unit_is_said_before_the_distance():
    with pytest.raises(DataError, match="look like millimetres"):
        checked(TABLE.assign(x_m=1e3 * TABLE.x_m + 4e5, y_m=1e3 * TABLE.y_m))


@pytest.mark.parametrize("size", [1, 100])
def test_a_mapping_is_proposed_with_offsets(size):
    """Of positions in centimetres, too: offsets are in metres."""
    unit = "" if size == 1 else "_cm"
    log = pd.DataFrame({"t_s": TABLE.t_s, "left_m_s": TABLE.left_m_s, "right_m_s": TABLE.right_m_s, "trial": TABLE.trial})
    log = log.assign(**{f"pos_x{unit}": size * moved().x_m, f"pos_y{unit}": size * moved().y_m, "yaw_rad": TABLE.heading_rad})
    guess = guessed(log)
    assert [guess.mapping["columns"][name]["offset"] for name in ("x_m", "y_m")] == [-EAST, -NORTH]
    assert any("Give other logs of the same site the same offsets" in one for one in guess.remarks)
    usable, _ = checked(applied(log, yaml.safe_load(guess.text)))
    np.testing.assert_allclose(usable[["x_m", "y_m"]], checked(TABLE)[0][["x_m", "y_m"]], atol=1e-6)
    near = guessed(log.assign(**{f"pos_x{unit}": size * TABLE.x_m, f"pos_y{unit}": size * TABLE.y_m}))
    assert "offset" not in near.text


def test_a_mapping_without_the_offsets_is_refused_as_the_log_is(tmp_path):
    log = moved().rename(columns={"x_m": "easting", "y_m": "northing"})
    log.to_csv(tmp_path / "field.csv", index=False)
    rules = {"columns": {"x_m": {"from": "easting"}, "y_m": {"from": "northing"}}}
    with pytest.raises(DataError, match=r"field\.csv: The positions lie 5829783 m .* In the mapping field\.csv\.import\.yaml"):
        import_log([tmp_path / "field.csv"], rules)


def test_the_page_shows_the_paths_and_what_is_wrong():
    menus = Menus({"": moved()})
    bare = {"columns": {name: {"from": name} for name in TABLE.columns}}
    shown = preview({"": moved()}, bare)
    assert "lie 5829783 m from the origin" in shown.problem
    assert len(shown.paths) == 3
    assert not preview({"": moved()}, menus.guess.mapping).problem
