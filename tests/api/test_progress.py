"""Progress tells a share that never falls and ends at 1, and the command line how long is left."""

import io
import threading
from itertools import pairwise

import pytest

import bns
from bns.api.common.progress import Meter, part
from bns.cli.progress_bar import ticking, time_left
from tests.diagnose.worlds import NOMINAL, hidden, measured


@pytest.fixture(scope="module")
def table():
    return measured(hidden(turn_slip={"slip_s": 0.12}), trials=12, commands=3)


def shares(work):
    """All that was told, in order."""
    told = []
    work(lambda share, text: told.append((share, text)))
    return told


@pytest.mark.parametrize(
    "work",
    [
        lambda t, p: bns.compare(t, NOMINAL, progress=p),
        lambda t, p: bns.diagnose(t, NOMINAL, progress=p),
        lambda t, p: bns.add(t, ["turn-slip", "motor-lag"], NOMINAL, progress=p),
    ],
    ids=["compare", "diagnose", "add"],
)
def test_a_share_never_falls_and_ends_at_one(table, work):
    told = [share for share, _ in shares(lambda p: work(table, p))]
    assert all(0.0 <= share <= 1.0 for share in told)
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert len(set(told)) > 2
    assert max(b - a for a, b in pairwise(told)) < 0.75


@pytest.mark.slow
def test_proposing_and_reporting_share_theirs_between_their_parts(table, tmp_path):
    told = shares(lambda p: bns.report(table, NOMINAL, tmp_path / "r.html", minutes=1, progress=p))
    assert [share for share, _ in told] == sorted(share for share, _ in told)
    assert told[-1][0] == 1.0
    assert any(share > 0.4 and "effects" not in text for share, text in told)


def test_a_meter_slows_down_rather_than_going_back():
    told = []
    meter = Meter(lambda share, text: told.append(share), {"late": 0.8}, pace=10)
    for _ in range(100):
        meter("an effect")
    assert 0.5 < told[9] < 0.6
    assert told[-1] < 0.8
    meter("late")
    assert told[-1] == 0.8
    meter.done()
    assert told[-1] == 1.0


def test_a_meter_may_be_told_by_many_threads():
    told = []
    meter = Meter(lambda share, text: told.append(share), {}, pace=100)
    threads = [threading.Thread(target=lambda: [meter("x") for _ in range(200)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(told) == 800
    assert told == sorted(told)


def test_a_part_lies_within_the_whole():
    told = []
    half = part(lambda share, text: told.append(share), 0.5, 1.0)
    half(0.0, "a")
    half(1.0, "b")
    assert told == [0.5, 1.0]


def test_time_left_follows_from_the_time_taken():
    assert time_left(10.0, 0.25) == "30 s left"
    assert time_left(100.0, 0.25) == "5 min left"
    assert time_left(10.0, 0.01) == ""
    assert time_left(10.0, 1.0) == "0 s left"


def test_nothing_is_said_off_a_terminal(monkeypatch):
    written = io.StringIO()
    monkeypatch.setattr("sys.stderr", written)
    with ticking("diagnosing") as tick:
        tick(0.5, "motor-lag")
    assert written.getvalue() == ""
