"""The table that robots and simulations share."""

import errno

import numpy as np
import pandas as pd
import pytest

from bns.cli.main import main
from bns.errors import ModelError
from bns.measurements import COLUMNS, trial_table, write_measurements

COMMANDS = [[0.1, 0.2, 0.5], [0.0, 0.1, 1.5]]
POSES = [[0, 0, 0], [0.07, 0.01, 0.5], [0.1, 0.02, 2.0]]


def test_rows_hold_what_is_in_force_from_their_time_on():
    table = trial_table(3, COMMANDS, POSES)
    assert tuple(table.columns) == COLUMNS
    assert table["trial"].tolist() == [3, 3, 3]
    assert table["t_s"].tolist() == [0.0, 0.5, 2.0]
    assert table["left_m_s"].tolist()[:2] == [0.1, 0.0]
    assert table[["left_m_s", "right_m_s"]].iloc[-1].isna().all()
    np.testing.assert_array_equal(table[["x_m", "y_m", "heading_rad"]], POSES)


@pytest.mark.parametrize(("suffix", "read"), [("csv", pd.read_csv), ("parquet", pd.read_parquet)])
def test_written_tables_come_back_with_their_further_columns(tmp_path, suffix, read):
    table = trial_table(1, COMMANDS, POSES).assign(battery_v=7.4)
    write_measurements(table, tmp_path / f"m.{suffix}")
    pd.testing.assert_frame_equal(read(tmp_path / f"m.{suffix}"), table)
    assert [p.name for p in tmp_path.iterdir()] == [f"m.{suffix}"]


def test_empty_commands_are_empty_in_csv(tmp_path):
    write_measurements(trial_table(1, COMMANDS, POSES), tmp_path / "m.csv")
    assert (tmp_path / "m.csv").read_text().splitlines()[-1] == "1,2.0,,,0.1,0.02,2.0"


def test_what_does_not_fit_is_refused(tmp_path):
    with pytest.raises(ModelError, match=r"trial 7: commands have the shape \(2, 3\) and poses \(2, 3\)"):
        trial_table(7, COMMANDS, POSES[:2])
    table = trial_table(1, COMMANDS, POSES)
    with pytest.raises(ModelError, match="lacks x_m, y_m"):
        write_measurements(table.drop(columns=["x_m", "y_m"]), tmp_path / "m.csv")
    with pytest.raises(ModelError, match=r"end in \.csv or \.parquet"):
        write_measurements(table, tmp_path / "m.xlsx")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_place_that_cannot_be_written_is_named_and_no_part_of_a_table_stays(tmp_path, monkeypatch, suffix, capsys):
    """Arrow's errors name no file of their own and say `Failed to open local file ... Detail: ...` for its reason."""
    table, path = trial_table(1, COMMANDS, POSES), tmp_path / f"m.{suffix}"
    table.to_csv(tmp_path / "log.csv", index=False)

    def refused(_table, unfinished, **_):
        unfinished.write_bytes(b"part")
        raise OSError(errno.EROFS, f"Failed to open local file '{unfinished}'. Detail: [errno 30] Read-only file system")

    monkeypatch.setattr(pd.DataFrame, f"to_{suffix}", refused)
    with pytest.raises(OSError, match="Read-only file system") as said:
        write_measurements(table, path)
    assert (said.value.filename, said.value.strerror, said.value.errno) == (str(path), "Read-only file system", errno.EROFS)
    assert main(["import", str(tmp_path / "log.csv"), "-o", str(path)]) == 2
    assert f"cannot use {path}: Read-only file system. Choose another place" in capsys.readouterr().err
    assert sorted(p.name for p in tmp_path.iterdir() if p.name.startswith((".m", "m."))) == []
