from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from store.synthetic import record

from bns.cli.commands import watch as watching
from bns.cli.commands.watch import trace, watch
from bns.cli.main import main
from bns.errors import BnsError
from bns.spec import RunSpec
from bns.store import Writer

pytestmark = pytest.mark.slow


def add_runs(results: Path, seed: int) -> None:
    with Writer(results, "grid") as writer:
        for rate in (0.1, 0.5):
            writer.append(record(RunSpec(seed=seed, evaluations=3, mutation_rate=rate)))


class Rounds:
    """Stands for the waiting between two looks: does something to the results each time, then interrupts."""

    def __init__(self, *events):
        self.events, self.waited = list(events), []

    def __call__(self, seconds):
        self.waited.append(seconds)
        if not self.events:
            raise KeyboardInterrupt
        self.events.pop(0)()


def test_the_page_follows_the_runs_and_is_at_rest_in_the_end(tmp_path):
    page, seen, said = tmp_path / "figures" / "index.html", [], []

    def look():
        text = page.read_text()
        seen.append((re.findall(r"n = (\d+) runs", text)[0], 'http-equiv="refresh" content="2"' in text))

    rounds = Rounds(lambda: add_runs(tmp_path, 0), lambda: (look(), add_runs(tmp_path, 1)), look)
    with pytest.raises(KeyboardInterrupt):
        watch(tmp_path, 0.01, said.append, rounds)
    assert seen == [("2", True), ("4", True)]
    assert "http-equiv" not in page.read_text()
    assert said[0].startswith(f"bns: there are no runs in {tmp_path}")
    assert said[1:] == [f"{page.as_uri()} is up to date"]


def test_nothing_is_drawn_while_nothing_changes(tmp_path, monkeypatch):
    add_runs(tmp_path, 0)
    drawn = []
    monkeypatch.setattr(watching, "draw", lambda *what: drawn.append(what) or "")
    with pytest.raises(KeyboardInterrupt):
        watch(tmp_path, 5, lambda text: None, Rounds(lambda: None, lambda: None, lambda: add_runs(tmp_path, 1)))
    assert len(drawn) == 2


def test_a_page_that_takes_long_is_drawn_less_often(tmp_path, monkeypatch):
    add_runs(tmp_path, 0)
    rounds = Rounds()
    monkeypatch.setattr(watching, "draw", lambda *what: time.sleep(0.3) or "")
    with pytest.raises(KeyboardInterrupt):
        watch(tmp_path, 0.01, lambda text: None, rounds)
    assert rounds.waited[0] >= 0.3


def test_a_run_in_the_journal_and_a_fold_leave_a_trace(tmp_path):
    empty = trace(tmp_path)
    with Writer(tmp_path, "grid") as writer:
        writer.append(record(RunSpec(evaluations=3)))
        pending = trace(tmp_path)
    assert len({empty, pending, trace(tmp_path)}) == 3
    assert trace(tmp_path) == trace(tmp_path)


def test_without_the_scripts_the_message_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setattr("bns.shipped.PACKAGE", tmp_path / "bns")
    with pytest.raises(BnsError, match=r"did not come with this package.*pip install --force-reinstall bns"):
        watch(tmp_path)


def test_a_message_of_the_scripts_says_once_who_speaks(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("bns.cli.commands.watch.watch", lambda _results, _every, say: (say("bns: no runs"), say("drawn")))
    assert main(["watch", "--results", str(tmp_path)]) == 0
    assert capsys.readouterr().err == "bns: no runs\nbns: drawn\n"


def test_ctrl_c_ends_the_command_quietly(tmp_path):
    command = [sys.executable, "-m", "bns", "watch", "--results", str(tmp_path / "none"), "--every", "1s"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        first = process.stderr.readline()
        process.send_signal(signal.SIGINT)
        _, rest = process.communicate(timeout=600)
    assert "there are no runs in" in first
    assert "Traceback" not in rest
    assert process.returncode == 130
