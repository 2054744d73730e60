"""Lines of a log that were changed, lost, doubled or exchanged are named; logs from before checksums are read with a note."""

import json
import re
import subprocess

import numpy as np
import pytest

from bns.errors import HardwareError
from bns.hardware.clock import EmulatedClock
from bns.hardware.link.hardware_log import HardwareLog, events
from bns.hardware.link.sealed_lines import LogWarning


def write(path, count, first=0):
    with HardwareLog(path, EmulatedClock(np.inf)) as log:
        for number in range(first, first + count):
            log.note("sent", data=f"D,{number},{number}")


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "journal.jsonl"
    write(path, 12)
    write(path, 8, first=12)  # as after --resume
    return path


def data_of(path):
    return [event["data"] for event in events(path, "sent")]


def test_what_was_written_is_read(log):
    assert data_of(log) == [f"D,{number},{number}" for number in range(20)]
    assert [event["n"] for event in events(log)] == list(range(1, 21))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda lines: [*lines[:6], *lines[7:]], "line 7 of .* is number 8: lines before it are lost"),
        (lambda lines: lines[1:], "line 1 of .* is number 2: lines before it are lost"),
        (lambda lines: [*lines[:7], *lines[6:]], "line 8 of .* is number 7: it is there twice"),
        (lambda lines: [*lines[:6], lines[7], lines[6], *lines[8:]], "line 7 of .* is number 8"),
        (lambda lines: [*lines[:6], lines[6].replace("D,6", "D,9"), *lines[7:]], "line 7 of .* was changed"),
        (lambda lines: [*lines[:6], lines[6].split(',"n"')[0] + "}\n", *lines[7:]], "line 7 of .* was changed"),
        (lambda lines: [lines[0].split(',"n"')[0] + "}\n", *lines[1:]], "line 2 of .* was changed, or one above it"),
        (lambda lines: [*lines[:6], lines[6][:-1] + lines[7], *lines[8:]], "line 7 of .*"),
    ],
)
@pytest.mark.filterwarnings("ignore::bns.hardware.link.sealed_lines.LogWarning")
def test_lines_that_are_not_as_they_were_are_named(log, change, message):
    log.write_text("".join(change(log.read_text().splitlines(keepends=True))))
    with pytest.raises(HardwareError, match=message):
        data_of(log)


def test_lines_of_another_log_do_not_pass(log, tmp_path):
    other = tmp_path / "other.jsonl"
    with HardwareLog(other, EmulatedClock(np.inf)) as written:
        for number in range(20):
            written.note("sent", data=f"D,{number},{-number}")
    lines, theirs = log.read_text().splitlines(keepends=True), other.read_text().splitlines(keepends=True)
    log.write_text("".join([*lines[:9], theirs[9], *lines[10:]]))
    with pytest.raises(HardwareError, match="line 10 of"):
        data_of(log)


def test_any_changed_byte_is_noticed(log):
    """Every byte but the last: without its end the last line is one that was being written."""
    whole, draw = log.read_bytes(), np.random.default_rng(3)
    for at in draw.integers(len(whole) - 1, size=300):
        data = bytearray(whole)
        data[at] ^= 1 << int(draw.integers(8))
        log.write_bytes(data)
        with pytest.raises(HardwareError, match=re.escape(str(log))):
            data_of(log)


def test_what_the_message_says_to_keep_is_all_that_stands_above_the_change(log):
    whole, draw = log.read_bytes(), np.random.default_rng(4)
    for at in draw.integers(len(whole) - 1, size=60):
        data = bytearray(whole)
        data[at] ^= 1 << int(draw.integers(7))
        log.write_bytes(data)
        with pytest.raises(HardwareError) as refused:
            data_of(log)
        changed = whole[:at].count(b"\n")
        told = re.search(r"head -n (\d+)", str(refused.value))
        kept = int(told[1]) if told else 0
        assert kept == (changed if changed else 0)
        log.write_bytes(b"".join(data.splitlines(keepends=True)[:kept]))
        assert data_of(log) == [f"D,{number},{number}" for number in range(kept)]


def test_what_the_message_says_to_keep_is_a_command_whatever_the_folder_is_called(log, tmp_path):
    folder = tmp_path / "my results"
    folder.mkdir()
    lines = log.read_text().splitlines(keepends=True)
    odd = folder / log.name
    odd.write_text("".join([*lines[:6], *lines[7:]]))
    with pytest.raises(HardwareError) as refused:
        data_of(odd)
    command = re.search(r"head -n .* > FILE", str(refused.value))[0]
    subprocess.run(["bash", "-c", command], cwd=tmp_path, check=True)
    assert (tmp_path / "FILE").read_text() == "".join(lines[:6])


def test_last_line_without_an_end_is_passed_over_and_gone_on_after(log):
    log.write_bytes(log.read_bytes()[:-5])
    assert len(data_of(log)) == 19
    write(log, 1, first=19)
    assert data_of(log) == [f"D,{number},{number}" for number in range(20)]


def test_logs_from_before_checksums_are_read_with_a_note_and_sealed_by_what_follows(tmp_path):
    path = tmp_path / "journal.jsonl"
    lines = [
        json.dumps({"t_s": n, "kind": "sent", "data": f"D,{n},{n}"}, separators=(",", ":")) + "\n" for n in range(3)
    ]
    path.write_text("".join(lines))
    with pytest.warns(LogWarning, match="lines 1 to 3 were written before lines had checksums"):
        assert len(data_of(path)) == 3
    write(path, 2, first=3)
    with pytest.warns(LogWarning, match="lines 1 to 3"):
        assert data_of(path) == [f"D,{number},{number}" for number in range(5)]
    path.write_text(path.read_text().replace("D,1", "D,7"))
    with pytest.raises(HardwareError, match=r"line 4 of .* was changed, or one above it"):
        data_of(path)
