"""Files as OptiTrack Motive and Vicon export them, and commands that were logged by another clock.

How the files are laid out follows exports that others published (Motive 1.21 and 1.23 by two laboratories; Vicon Tracker and
Nexus by readers of theirs), not this reader.
"""

import gzip

import numpy as np
import pandas as pd
import pytest
import yaml

from bns.cli.main import main
from bns.diagnose.data.guess.clocks import clocks
from bns.diagnose.data.guess.mapping import guessed
from bns.diagnose.data.import_log import import_log, proposal
from bns.diagnose.data.sources.read import read_table
from bns.errors import DataError
from tests.diagnose.logs import continuous
from tests.diagnose.worlds import NOMINAL, measured

BEGINS_S = 722.1
"""Frames before were not exported."""
APART_S = 3.4 - 1_780_000_000.0
"""Commands have the time of day; the take began so long after."""
MARKER = "Trajectories\n100\n,,a,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,1,2,3\n"
"""A part of a file of Vicon that holds no body."""


@pytest.fixture(scope="module")
def log():
    return continuous(measured(NOMINAL, trials=8, seed=4))


def commands(log, path, apart_s=-APART_S):
    changed = log[["left_m_s", "right_m_s"]].diff().abs().max(axis=1).fillna(1.0) > 0
    told = log.loc[changed, ["t_s", "left_m_s", "right_m_s"]]
    told.assign(t_s=told["t_s"] + BEGINS_S + apart_s).to_csv(path, index=False, float_format="%.6f")


def motive(log, path, version="1.23", up="y", rotation="Quaternion", unit=("Meters", 1.0), others=("table",), marker=True):
    """A take: the robot and other bodies, each with its mean error, then a marker."""
    half = log["heading_rad"] / 2
    x, y, high = (log["x_m"] * unit[1], log["y_m"] * unit[1], pd.Series(0.1912 * unit[1], index=log.index))
    zero = high * 0
    about = {"y": (zero, np.sin(half), zero), "z": (zero, zero, np.sin(half))}[up]
    turned = [*about, np.cos(half)] if rotation == "Quaternion" else [zero, np.degrees(log["heading_rad"]), zero]
    place = [x, high, -y] if up == "y" else [x, y, high]
    still = [one.iloc[0] * np.ones(len(log)) for one in (*turned, *place)]
    error = np.full(len(log), 0.0002)
    values, kinds, names, quantities, axes = [], [], [], [], []
    for name, columns in (("robot", [*turned, *place, error]), *((other, [*still, error]) for other in others)):
        values += columns
        kinds += ["Rigid Body"] * len(columns)
        names += [name] * len(columns)
        quantities += ["Rotation"] * len(turned) + ["Position"] * 3 + ["Mean Marker Error"]
        axes += [*("XYZW"[: len(turned)]), *"XYZ", ""]
    if marker:
        values += place
        kinds += ["Marker"] * 3
        names += ["robot:Marker1"] * 3
        quantities += ["Position"] * 3
        axes += [*"XYZ"]
    first = f"Format Version,{version},Take Name,Take 1, with care,Capture Frame Rate,120.000000,Rotation Type,{rotation},"
    first = first.replace("1, with", "1 with") + f"Length Units,{unit[0]},Coordinate Space,Global"
    words = ("", "", "") if version == "1.21" else ("Type", "Name", "ID")
    ids = [f'"{abs(hash(name)):X}"' for name in names]
    above = [[words[0], *kinds], [words[1], *names], [words[2], *ids]]
    above += [["Parent", *[""] * len(names)]] if version == "1.25" else []
    above += [["", *quantities]]
    frames = np.round((BEGINS_S + log["t_s"]) * 100).astype(int)
    lines = [first, "", *(",".join(["", *row]) for row in above)]
    lines.append(",".join(["Frame", "Time" if version == "1.21" else "Time (Seconds)", *axes]))
    for n, row in enumerate(np.array(values).T):
        cells = [f"{v:.6f}" for v in row]
        lost = n % 50 == 7  # a frame without the robot
        cells[: len(turned) + 4] = [""] * (len(turned) + 4) if lost else cells[: len(turned) + 4]
        lines.append(",".join([str(frames.iloc[n]), f"{BEGINS_S + log['t_s'].iloc[n]:.6f}", *cells]))
    opened = gzip.open if path.suffix == ".gz" else open
    with opened(path, "wt", encoding="utf-8") as out:
        out.write("\n".join(lines) + "\n")


def vicon(log, path, separator=",", kind="Objects", after=""):
    """An object as Tracker exports it, by a rotation vector; at 100 Hz, frames counted from 1."""
    frame_s = 0.01
    at = np.arange(log["t_s"].iloc[0], log["t_s"].iloc[-1], frame_s)
    x, y, heading = (np.interp(at, log["t_s"], log[name]) for name in ("x_m", "y_m", "heading_rad"))
    wrapped = np.degrees(np.angle(np.exp(1j * heading)))
    rows = [[n + 1, 0, 0.01, -0.02, wrapped[n], 1000 * x[n], 1000 * y[n], 191.2] for n in range(len(at))]
    axes = ["Frame", "Sub Frame", "RX", "RY", "RZ", "TX", "TY", "TZ"]
    named = [["", "", "robot:robot"], axes, ["", "", *["deg"] * 3, *["mm"] * 3]]
    lines = [[kind], ["100"], *named, *[[f"{v:g}" if n < 2 else f"{v:.5f}" for n, v in enumerate(row)] for row in rows]]
    path.write_text("\n".join(separator.join(line) for line in lines) + "\n" + after, encoding="utf-8")
    return frame_s


def driven(table):
    """How far and how much the robot of a table went and turned."""
    seen = table.dropna(subset=["x_m", "y_m", "heading_rad"])
    x, y, heading = (seen[name].to_numpy() for name in ("x_m", "y_m", "heading_rad"))
    turn = np.unwrap(heading)
    return x, y, turn, seen["session_s"].to_numpy()


def same_path(table, log):
    x, y, turn, t = driven(table)
    for got, name in ((x, "x_m"), (y, "y_m"), (turn, "heading_rad")):
        want = np.interp(t, log["t_s"], log[name])
        assert np.abs(got - got[0] - (want - want[0])).max() < 1e-3


@pytest.mark.parametrize("version", ["1.21", "1.23", "1.25"])
@pytest.mark.parametrize(
    "take",
    [{}, {"up": "z"}, {"unit": ("Millimeters", 1e3)}, {"rotation": "XYZ"}, {"unit": ("Centimeters", 1e2), "marker": False}],
    ids=["metres", "z up", "mm", "angles", "cm"],
)
def test_a_take_of_motive_is_read_by_its_own_proposal(tmp_path, log, version, take):
    motive(log, tmp_path / "take.csv", version, **take)
    commands(log, tmp_path / "told.csv")
    files = [tmp_path / "take.csv", tmp_path / "told.csv"]
    text = proposal(files)
    assert "The poses are those of robot; the file has table, too. Name the robot's." in text
    out = import_log(files, yaml.safe_load(text))
    same_path(out.table, log)
    assert out.trials == 8


@pytest.mark.parametrize("up", ["y", "z"])
def test_the_axis_that_points_up_is_told_even_where_the_robot_hardly_turned(tmp_path, log, up):
    """Within 20 degrees of one direction it is upright about either axis, by the limit for robots on a floor."""
    straight = log.assign(heading_rad=0.35 * np.sin(log["heading_rad"]))
    motive(straight, tmp_path / "take.csv", up=up)
    entries = guessed(read_table(tmp_path / "take.csv")).mapping["columns"]
    assert entries["heading_rad"].get("up", "z") == up
    assert entries["y_m"] == {"y": {"from": "robot.position.z [m]", "scale": -1}, "z": {"from": "robot.position.y [m]"}}[up]


def test_the_clocks_of_the_files_are_joined_where_the_speeds_fit(tmp_path, log):
    """By 10 ms, though the two count from other origins; the robot of this log has no lag."""
    motive(log, tmp_path / "take.csv.gz")
    commands(log, tmp_path / "told.csv")
    tables = [read_table(tmp_path / name) for name in ("take.csv.gz", "told.csv")]
    guess = guessed(tables[0], {"told.csv": tables[1]}, "take.csv.gz")
    entry = guess.mapping["also"][0]["columns"]["t_s"]
    assert entry["offset"] == pytest.approx(APART_S, abs=0.02)
    assert any("The clocks of the two files differ" in said for said in guess.remarks)
    turned = guessed(tables[1], {"take.csv.gz": tables[0]}, "told.csv")  # the commands first: then the poses are moved
    assert turned.mapping["also"][0]["columns"]["t_s"]["offset"] == pytest.approx(-APART_S, abs=0.02)


@pytest.mark.parametrize("apart_s", [0.0, 0.3])
def test_clocks_that_agree_but_for_a_lag_are_left_alone(tmp_path, log, apart_s):
    motive(log, tmp_path / "take.csv")
    commands(log, tmp_path / "told.csv", apart_s)
    assert "offset" not in proposal([tmp_path / "take.csv", tmp_path / "told.csv"])


def test_commands_that_repeat_themselves_join_no_clocks(log):
    """They fit at several shifts; one that is 30 s off would be as good as the right one."""
    t = np.arange(0.0, 300.0, 0.04)
    seen = {"t_s": {"from": "t"}, "x_m": {"from": "x"}, "y_m": {"from": "y"}}
    sent = {"t_s": {"from": "t"}, "left_m_s": {"from": "l"}, "right_m_s": {"from": "l"}}
    again = np.where((t % 30.0) < 10.0, 0.1, 0.0)
    once = np.repeat(np.random.default_rng(5).uniform(0.0, 0.2, 60), 125)
    found = []
    for speed in (again, once):
        poses = pd.DataFrame({"t": t, "x": np.cumsum(speed) * 0.04, "y": 0 * t})
        found.append(clocks((poses, seen), (pd.DataFrame({"t": t + 1000.0, "l": speed}), sent)))
    assert found[0] is None
    assert found[1].offset_s == pytest.approx(-1000.0, abs=0.05)


@pytest.mark.parametrize(("separator", "kind"), [(",", "Objects"), (";", "Segments"), ("\t", "Objects")])
def test_an_object_of_vicon_is_read_by_its_own_proposal(tmp_path, log, separator, kind):
    vicon(log, tmp_path / "one.csv", separator, kind, after=f"\n{MARKER}")
    commands(log, tmp_path / "told.csv", 0.01 - BEGINS_S)
    files = [tmp_path / "one.csv", tmp_path / "told.csv"]
    out = import_log(files, yaml.safe_load(proposal(files)))
    same_path(out.table, log)


def test_a_part_of_vicon_before_the_object_is_passed_over(tmp_path, log):
    vicon(log, tmp_path / "one.csv")
    alone = read_table(tmp_path / "one.csv")
    (tmp_path / "two.csv").write_text(f"{MARKER}2,0,1,2,3\n\n" + (tmp_path / "one.csv").read_text())
    pd.testing.assert_frame_equal(read_table(tmp_path / "two.csv"), alone)
    assert list(alone.columns[:3]) == ["time [s]", "robot.RX [deg]", "robot.RY [deg]"]


HEAD = (
    "Format Version,1.23,Length Units,{unit}\n\n,Type,{kind},{kind},{kind}\n,Name,r,r,r\n,ID,1,1,1\n"
    ",,Position,Position,Position\n"
)
AXES = "Frame,Time (Seconds),X,Y,Z\n0,0,1,2,3\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEAD.format(unit="Meters", kind="Marker") + AXES, "holds no rigid body"),
        (HEAD.format(unit="Furlongs", kind="Rigid Body") + AXES, "is in Furlongs; allowed are"),
        (HEAD.format(unit="Meters", kind="Rigid Body") + "0,0,1,2,3\n", "none of its first 200 lines begins with Frame"),
        ("Format Version,1.23\n\n" + AXES, "does not say what its columns are of"),
        (HEAD.format(unit="Meters", kind="Rigid Body") + "Frame,Sub,X,Y,Z\n0,0,1,2,3\n", "no column of times"),
        (MARKER, "holds Trajectories alone"),
        ("Objects\nfast\n,,a\nFrame,Sub Frame,RX\n,,deg\n1,0,1\n", "frame rate"),
        ("Objects\n100\n,,,\nFrame,Sub Frame,RX\n,,deg\n1,0,1\n", "names no body"),
        ("Objects\n", "none of its first 200 lines begins with Frame"),
    ],
)
def test_an_export_that_lacks_something_says_what_and_what_to_do(tmp_path, text, said):
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(DataError, match=said) as error:
        read_table(tmp_path / "bad.csv")
    assert "bad.csv" in str(error.value)
    assert "xport" in str(error.value)


def test_an_export_with_a_field_that_no_reader_takes_is_refused(tmp_path):
    (tmp_path / "bad.csv").write_text(HEAD.format(unit="Meters" + "s" * 200_000, kind="Rigid Body") + AXES)
    with pytest.raises(DataError, match=r"bad.csv does not read as csv: field larger than field limit"):
        read_table(tmp_path / "bad.csv")


def test_the_command_line_proposes_and_imports(tmp_path, log, capsys):
    motive(log, tmp_path / "take.csv")
    commands(log, tmp_path / "told.csv")
    files = [str(tmp_path / "take.csv"), str(tmp_path / "told.csv")]
    assert main(["import", *files, "--propose", "-o", str(tmp_path / "take.csv.import.yaml")]) == 0
    assert main(["import", *files, "-o", str(tmp_path / "m.parquet")]) == 0
    assert "of 8 trials" in capsys.readouterr().out
