"""A user's own columns, units and conventions."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bns.api.measurements import Measurements
from bns.cli.main import main
from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.load import load_measured, measured_table
from bns.diagnose.data.mapping import files_behind, load_mapping, refuse_to_replace
from bns.errors import DataError
from bns.measurements import write_measurements
from tests.diagnose.worlds import NOMINAL, measured

MAPPING = """
columns:
  trial: {from: run}
  t_s: {from: time, unit: ms}
  left_m_s: {from: vl, unit: mm/s}
  right_m_s: {from: vr, unit: mm/s}
  x_m: {from: X, unit: cm}
  y_m: {from: Y, unit: cm}
  heading_rad: {from: compass, unit: deg, clockwise: true, zero_deg: 90}
"""


@pytest.fixture
def log(tmp_path):
    table = measured(NOMINAL, trials=2)
    foreign = pd.DataFrame(
        {
            "run": table.trial,
            "time": table.t_s * 1000,
            "vl": table.left_m_s * 1000,
            "vr": table.right_m_s * 1000,
            "X": table.x_m * 100,
            "Y": table.y_m * 100,
            "compass": 90 - np.degrees(table.heading_rad),
            "mood": "good",
        }
    )
    foreign.to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "map.yaml").write_text(MAPPING)
    return tmp_path, table


def test_a_foreign_log_becomes_the_table(log, capsys):
    folder, table = log
    done = main(["import", str(folder / "log.csv"), "--map", str(folder / "map.yaml"), "-o", str(folder / "m.parquet")])
    assert done == 0
    back = pd.read_parquet(folder / "m.parquet")
    for name in ("t_s", "left_m_s", "x_m", "heading_rad"):
        np.testing.assert_allclose(back[name], table[name], atol=1e-9)
    assert (back["mood"] == "good").all()
    assert "2 trials written" in capsys.readouterr().out


def test_the_mapping_is_kept_beside_the_data_and_used(log):
    folder, table = log
    main(["import", str(folder / "log.csv"), "--map", str(folder / "map.yaml"), "-o", str(folder / "m.csv")])
    assert (folder / "log.csv.import.yaml").is_file()
    np.testing.assert_allclose(load_measured(folder / "log.csv").tracks.pose[:, 0], table["x_m"], atol=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("unit: cm", "unit: rad", "x_m cannot be in rad; it may be in m, cm, mm, in"),
        ("unit: cm", "unit: furlong", "unknown unit 'furlong'"),
        ("unit: ms", "unit: milliseconds", "unknown unit 'milliseconds'. Did you mean 'ms'?"),
        ("unit: deg", "unit: Degree", "unknown unit 'Degree'. Did you mean 'deg'?"),
        ("vl, unit: mm/s", "vl, unit: rpm", "left_m_s: rpm is no unit here; .* scale instead, the wheel's radius in metres"),
        ("from: X", "form: X", "x_m is .*; write {from: COLUMN"),
        ("clockwise", "clokwise", "Did you mean 'clockwise'"),
        ("from: X,", "from: x,", "asks for an unknown column 'x'"),
        ("columns:", "cols:", "must have the key columns"),
    ],
)
def test_mappings_that_are_wrong_say_where(log, old, new, message):
    folder, _ = log
    path = folder / "map.yaml"
    path.write_text(MAPPING.replace(old, new))
    with pytest.raises(DataError, match=message):
        applied(pd.read_csv(folder / "log.csv"), load_mapping(path))


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("clockwise", "clokwise", 8, r"heading_rad: unknown key 'clokwise'\. Did you mean 'clockwise'\? Valid: clockwise, "),
        ("unit: cm", "unit: rad", 6, "x_m cannot be in rad; it may be in m, cm, mm, in"),
        ("from: X,", "from: x,", 6, "x_m asks for an unknown column 'x'"),
        ("unit: ms", "unit: date", 3, "t_s is taken from time, which holds numbers, no dates; give their unit: s, ms"),
        ("columns:", "holds: 1\ncolumns:", 1, "unknown key 'holds'.* Valid: also, columns"),
        ("columns:", "trials: {gap_s: 0}\ncolumns:", 1, "trials is {'gap_s': 0}; write one of"),
        ("columns:", "also:\n- {file: no.csv, columns: {t_s: {from: t, unit: h}}}\ncolumns:", 2, "t_s: unknown unit 'h'"),
        ("left_m_s: ", "forward_m_s: ", 1, "there is forward_m_s but not turn_rad_s; the wheel speeds need both"),
        ("x_m: {", "x_m: [", 6, "no valid YAML"),
    ],
)
def test_every_message_about_a_mapping_begins_with_its_file_and_line(log, old, new, line, said):
    folder, _ = log
    path = folder / "log.csv.import.yaml"
    path.write_text(MAPPING.lstrip("\n").replace(old, new))
    with pytest.raises(DataError, match=rf"^the mapping {path}, line {line}: {said}"):
        load_measured(folder / "log.csv")


def test_a_mapping_in_memory_has_no_line():
    with pytest.raises(DataError, match=r"^the mapping: x_m cannot be in rad"):
        Measurements(pd.DataFrame({"X": [1.0]}), mapping={"columns": {"x_m": {"from": "X", "unit": "rad"}}})
    with pytest.raises(DataError, match=r"^the mapping: it is \{'cols': \{\}\}; it must have the key columns"):
        Measurements(pd.DataFrame({"X": [1.0]}), mapping={"cols": {}})


def test_no_mapping_lists_the_columns(log, capsys):
    folder, _ = log
    assert main(["import", str(folder / "log.csv"), "-o", str(folder / "m.csv")]) == 2
    assert "has the columns run, time, vl" in capsys.readouterr().err
    assert not (folder / "m.csv").exists()


@pytest.mark.parametrize("output", ["log.csv", "sub/../log.csv", "link.csv"])
def test_what_is_imported_is_not_overwritten(log, output, capsys):
    folder, _ = log
    (folder / "sub").mkdir()
    (folder / "link.csv").symlink_to(folder / "log.csv")
    before = {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    source, mapping = str(folder / "log.csv"), str(folder / "map.yaml")
    assert main(["import", source, "--map", mapping, "-o", str(folder / output)]) == 2
    assert "is what is imported" in capsys.readouterr().err
    assert before == {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def test_neither_is_a_second_file_of_the_log(log):
    folder, _ = log
    mapping = {"also": [{"file": "other.csv", "columns": {}}]}
    (folder / "other.csv").write_text("x")
    with pytest.raises(DataError, match=r"other\.csv is what is imported"):
        refuse_to_replace(folder / "other.csv", files_behind([folder / "log.csv"], mapping), "imported")
    refuse_to_replace(folder / "new.csv", [*files_behind([folder / "log.csv"], mapping), folder / "map.yaml"])


@pytest.mark.parametrize(
    ("words", "output"),
    [
        (("propose", "log.csv"), "log.csv"),
        (("propose", "other.csv", "--more", "log.csv"), "log.csv"),
        (("diagnose", "log.csv", "--settings", "mine.yaml"), "mine.yaml"),
        (("diagnose", "log.csv"), "log.csv.import.yaml"),
        (("add", "log.csv", "motor-lag"), "log.csv.import.yaml"),
    ],
)
def test_no_command_replaces_what_it_reads(tmp_path, monkeypatch, capsys, words, output):
    monkeypatch.chdir(tmp_path)
    for name in ("log.csv", "other.csv", "mine.yaml"):
        Path(name).write_text("as it was")
    Path("log.csv.import.yaml").write_text("columns: {x_m: {from: x}}\n")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert main([*words, "--model", "khepera", "-o", output]) == 2
    assert re.search(rf"{re.escape(output)} is what is read \(.*\); nothing was written\. Give another", capsys.readouterr().err)
    assert before == {path: path.read_bytes() for path in tmp_path.iterdir()}


def test_a_table_that_cannot_be_written_is_named_as_it_was_given(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(30, "Read-only file system", str(tmp_path / ".m.csv.7.part"))

    monkeypatch.setattr(pd.DataFrame, "to_csv", full)
    with pytest.raises(OSError, match="Read-only") as told:
        write_measurements(measured(NOMINAL, trials=1), tmp_path / "m.csv")
    assert told.value.filename == str(tmp_path / "m.csv")


@pytest.mark.parametrize("more", [False, True])
def test_trials_keep_their_names_where_some_rows_have_none(tmp_path, more):
    table = measured(NOMINAL, trials=4)
    table.to_csv(tmp_path / "whole.csv", index=False)
    lost = table.assign(trial=table["trial"].where(table.index % 97 != 3))
    assert lost["trial"].isna().any()
    lost.to_csv(tmp_path / "lost.csv", index=False)
    if more:
        shifted = table.assign(x_m=table["x_m"] + 1.0)
        shifted.to_csv(tmp_path / "first.csv", index=False)
        names = load_measured(tmp_path / "first.csv", None, [tmp_path / "lost.csv"]).tracks.names
        assert list(names) == [*"0123", *(f"1-lost: {n}" for n in range(4))]
    else:
        assert list(load_measured(tmp_path / "lost.csv").tracks.names) == list("0123")
        assert list(measured_table(lost, Path("table")).tracks.names) == list("0123")


def test_the_same_trial_in_two_files_is_refused(tmp_path):
    """Counted twice, it would make every interval too narrow, and two times six trials enough for a verdict."""
    table = measured(NOMINAL, trials=3)
    first, second = tmp_path / "first.csv", tmp_path / "second.csv"
    write_measurements(table, first)
    write_measurements(table[table.trial > 0].assign(trial=lambda t: t.trial + 5), second)
    with pytest.raises(DataError, match=r"second\.csv: trial 6 is trial 1 of .*first\.csv, row for row"):
        load_measured(first, more=[second])
    with pytest.raises(DataError, match=r"trial 0 is trial 0 of .*first\.csv"):
        Measurements([first, first])
    write_measurements(measured(NOMINAL, trials=3, seed=5), second)
    assert len(load_measured(first, more=[second]).tracks) == 6


@pytest.mark.parametrize(
    ("content", "message"), [(b"", r"log\.csv is empty"), ("trial,é\n".encode("utf-16"), "no text in UTF-8. Save it as UTF-8")]
)
def test_what_is_no_text_is_said_to_be_none(tmp_path, content, message):
    (tmp_path / "log.csv").write_bytes(content)
    with pytest.raises(DataError, match=message):
        load_measured(tmp_path / "log.csv")


def quaternions(order, up="z"):
    """A log whose headings are quaternions, and the mapping that names them in some order."""
    half = np.linspace(-3, 3, 100) / 2
    axis = {"z": "qz", "y": "qy"}[up]
    table = pd.DataFrame({"qx": 0.0, "qy": 0.0, "qz": 0.0, "qw": np.cos(half)}).assign(**{axis: np.sin(half)})
    return table, {"columns": {"heading_rad": {"from": list(order), "unit": "quaternion"}}}, 2 * half


@pytest.mark.parametrize(
    ("order", "up", "cure"),
    [
        (("qw", "qx", "qy", "qz"), "z", r"w first: from: \[qx, qy, qz, qw\]"),
        (("qx", "qy", "qz", "qw"), "y", "y axis seems to point up: up: y"),
        (("qz", "qw", "qx", "qy"), "z", "Check the order"),
    ],
)
def test_quaternions_of_a_robot_that_lies_on_its_side_are_refused(order, up, cure):
    table, mapping, _ = quaternions(order, up)
    with pytest.raises(DataError, match=rf"degrees off up \(median\).* The order must be x, y, z, w\. .*{cure}"):
        applied(table, mapping)


@pytest.mark.parametrize("up", ["z", "y"])
def test_quaternions_of_an_upright_robot_are_headings(up):
    table, mapping, heading = quaternions(("qx", "qy", "qz", "qw"), up)
    mapping["columns"]["heading_rad"]["up"] = up
    np.testing.assert_allclose(applied(table, mapping)["heading_rad"], heading, atol=1e-12)
    lost = applied(table.assign(qw=np.nan), mapping)
    assert lost["heading_rad"].isna().all()


def test_a_log_of_joints_is_not_cut_and_says_so(tmp_path):
    """Not that it lacks the commands of wheels."""
    table = pd.DataFrame({"t_s": [0.0, 1.0], "elbow_set_rad": [0.1, 0.2], "tip_x_m": [0.0, 0.1], "tip_y_m": [0.0, 0.1]})
    table.to_csv(tmp_path / "arm.csv", index=False)
    columns = "".join(f"  {name}: {{from: {name}}}\n" for name in table)
    (tmp_path / "arm.csv.import.yaml").write_text(f"columns:\n{columns}trials: {{lasting_s: 8}}\n")
    with pytest.raises(DataError, match=r"arm\.csv.*set points is not cut into trials: give it a column trial"):
        load_measured(tmp_path / "arm.csv")
