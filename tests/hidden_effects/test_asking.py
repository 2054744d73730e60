"""Asking: what was answered is kept, a world that changed is asked again, and a failure is an answer."""

import hashlib
import json
from dataclasses import replace
from pathlib import Path

from tests.hidden_effects import asking
from tests.hidden_effects.world import World

WORLD = World("w", "none", trials=2)


def test_json_on_stdout_is_the_answer(monkeypatch):
    def call(arguments):
        assert arguments[0] == "diagnose"
        assert arguments[2:] == ["--model", "khepera", "--json"]
        assert Path(arguments[1]).read_text().startswith("trial,t_s,left_m_s")
        return 0, json.dumps({"verdict": "none"}), ""

    monkeypatch.setattr(asking, "called", call)
    record = asking.ask(WORLD)
    assert record["answer"] == {"verdict": "none"}
    assert record["seconds_s"] >= 0


def test_no_json_is_no_answer(monkeypatch):
    monkeypatch.setattr(asking, "called", lambda _: (2, "", "bns: no such thing"))
    record = asking.ask(WORLD)
    assert (record["answer"], record["exit"], record["error"]) == (None, 2, "bns: no such thing")


def test_an_answer_is_kept_for_the_very_same_world(tmp_path):
    asking._keep(WORLD, tmp_path, {"answer": {"verdict": "none"}, "seconds_s": 1.0})
    assert asking._kept(WORLD, tmp_path)["answer"] == {"verdict": "none"}
    assert asking._kept(replace(WORLD, jitter=0.001), tmp_path) is None
    assert asking._kept(replace(WORLD, seed=1), tmp_path) is None
    assert [world for world, _ in asking.answers([WORLD], tmp_path, 1, False)] == [WORLD]


def test_an_answer_of_other_code_is_asked_again(tmp_path, monkeypatch):
    asking._keep(WORLD, tmp_path, {"answer": {"verdict": "none"}, "seconds_s": 1.0})
    monkeypatch.setattr(asking, "code_asked", lambda: "another")
    assert asking._kept(WORLD, tmp_path) is None


def test_the_code_that_is_asked_is_there():
    nothing = hashlib.sha256(b"").hexdigest()
    assert asking.code_asked() != nothing


def test_a_command_that_does_not_exist_is_told_not_raised():
    status, out, _ = asking.called(["no-such-command"])
    assert (status, out) == (2, "")
