"""A table of measurements that was edited, or is gone, when its trial is resumed: nothing of it is lost, or lost unsaid."""

import pytest

from bns.hardware.clock import EmulatedClock
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.link.sealed_lines import LogWarning
from bns.trial.folder import check_not_cut, keep_measurements, past_evaluations

from .calls import call
from .test_trial import paused

COLUMNS = ("t_s", "left_m_s", "x_m")


def driven(log, evaluation, x_m=0.0):
    rows = [{"t_s": 0.1 * step, "left_m_s": 0.1, "x_m": x_m + 0.01 * step, "cycle": step, "stable": 1.0} for step in range(3)]
    picked, poses = [[1, 2, 3]], [[0, 0, 0]] * 2
    log.note(
        "driven", evaluation=evaluation, picked=picked, commands=picked, poses=poses, rows=rows, session_s=5.0 * evaluation,
        readings={"battery_v": 7.5},
    )  # fmt: skip


@pytest.fixture
def journal(tmp_path):
    """Three drives of three rows, and their table."""
    path = tmp_path / "journal.jsonl"
    with HardwareLog(path, EmulatedClock(float("inf"))) as log:
        for evaluation in (1, 2, 3):
            driven(log, evaluation, float(evaluation))
    keep_measurements(path, COLUMNS)
    return path


def table_of(journal):
    return journal.with_name("measurements.csv")


def cell(lines, line, name, text):
    cells = lines[line - 1].split(",")
    cells[lines[0].split(",").index(name)] = text
    return [*lines[: line - 1], ",".join(cells), *lines[line:]]


def edited(journal, *changes):
    lines = table_of(journal).read_text().splitlines()
    for change in changes:
        lines = cell(lines, *change)
    table_of(journal).write_text("".join(f"{line}\n" for line in lines))


def test_a_table_as_it_was_written_is_passed_over(journal):
    check_not_cut(journal)
    assert sorted(path.name for path in journal.parent.iterdir()) == ["journal.jsonl", "measurements.csv"]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ([(6, "x_m", "9.5")], "line 6 (trial 2): x_m"),
        ([(2, "x_m", ""), (10, "battery_v", "3")], "lines 2 and 10 (trials 1 and 3): x_m, battery_v"),
        ([(3, "discarded", "1")], "line 3 (trial 1): discarded"),
        ([(3, "stable", "0.0")], "line 3 (trial 1): stable"),
        ([(line, "x_m", "0.5") for line in range(2, 11)], "9 lines (2, 3, 4, 5, 6, …) (trials 1, 2 and 3): x_m"),
    ],
)
def test_edited_cells_are_named_and_kept(journal, changes, said):
    edited(journal, *changes)
    before = table_of(journal).read_bytes()
    with pytest.warns(LogWarning) as caught:
        check_not_cut(journal)
    [warning] = caught
    assert said in str(warning.message)
    assert "The journal decides" in str(warning.message)
    copy = journal.with_name("measurements.old.csv")
    assert str(warning.message).endswith(f"it is kept as {copy}.")
    assert copy.read_bytes() == before
    with pytest.warns(LogWarning, match=r"kept as \S+measurements\.old\.csv"):  # again, and no second copy
        check_not_cut(journal)
    keep_measurements(journal, COLUMNS)
    check_not_cut(journal)
    assert copy.read_bytes() == before


def test_a_column_that_was_added_is_named_and_an_empty_one_is_not(journal):
    lines = table_of(journal).read_text().splitlines()
    for value in ("", "4"):
        table_of(journal).write_text("".join(f"{line},{'load' if not at else value}\n" for at, line in enumerate(lines)))
        if not value:
            check_not_cut(journal)
    with pytest.warns(LogWarning, match=r"9 lines .* \(trials 1, 2 and 3\): load\. The journal"):
        check_not_cut(journal)


def test_what_the_journal_came_to_say_after_the_table_was_made_is_no_edit(journal):
    with HardwareLog(journal, EmulatedClock(float("inf"))) as log:
        log.note("marked", evaluation=3, unstable=[0])
        log.note("discarded", evaluation=3)
        driven(log, 3, 30.0)
    check_not_cut(journal)
    assert len(past_evaluations(journal)) == 3


def test_without_a_table_nothing_shows_that_lines_are_lost_which_is_said(journal):
    check_not_cut(journal)
    table_of(journal).rename(journal.with_name("measurements.old.csv"))
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:1]))
    with pytest.warns(LogWarning, match=r"holds: 3 rows of measurements, up to trial 1; measurements\.old\.csv .* has 9 rows\."):
        check_not_cut(journal)
    journal.write_bytes(b"")
    with pytest.warns(LogWarning, match=r"holds: no measurements; measurements\.old\.csv beside it has 9 rows"):
        check_not_cut(journal)


def test_a_trial_that_has_driven_nothing_yet_has_lost_nothing(tmp_path):
    (tmp_path / "journal.jsonl").write_bytes(b"")
    check_not_cut(tmp_path / "journal.jsonl")
    (tmp_path / "last-drive.png").write_bytes(b"")
    with pytest.warns(LogWarning, match="nothing shows whether journal.jsonl has lost lines at its end.* no measurements"):
        check_not_cut(tmp_path / "journal.jsonl")


@pytest.mark.filterwarnings("default::bns.hardware.link.sealed_lines.LogWarning")
def test_an_edited_table_is_one_line_of_a_resumed_trial(tmp_path, capsys):
    asked, journal = paused(tmp_path)
    capsys.readouterr()
    edited(journal, (4, "x_m", "0.75"))
    before = table_of(journal).read_bytes()
    assert call(*asked, "--resume") == 0
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("bns: warning: ")]
    assert len(said) == 1
    assert "in line 4 (trial 1): x_m. The journal decides" in said[0]
    assert journal.with_name("measurements.old.csv").read_bytes() == before
    assert "0.75" not in table_of(journal).read_text().splitlines()[3]
