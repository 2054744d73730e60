"""`bns example robot DIR`: the package that it writes is announced as pip would, and goes through every command."""

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pandas as pd
import pytest

from bns.cli.main import main
from bns.examples import copy_robot
from bns.hardware.link.hardware_log import events
from bns.store.read.reader import load
from tests.plugins.package import announce
from tests.plugins.test_stranger import SCRIPT

pytestmark = pytest.mark.slow

ROBOT = ["--robot", "my-robot"]
SMALL = [
    *("--population-size", "30", "--training-iterations-per-evaluation", "20", "--generations-per-evaluation", "2"),
    *("--real-world-selection-size", "0.1"),
]
COMMANDS = {
    "run": ["run", *ROBOT, "--world", "physics", "--evaluations", "30", *SMALL, "--results", "logged", "--max-commands", "10",
            "--measurements", "log.csv"],
    "sweep": ["sweep", "sweep.yaml", "--jobs", "1", "--results", "results"],
    "diagnose": ["diagnose", "log.csv", "--model", "bare.yaml", "--json"],
    "trial": ["trial", *ROBOT, "--emulated", "--yes", "--speed", "inf", "--no-figures", "--evaluations", "1", *SMALL,
              "--max-commands", "4", "--results", "driven"],
    "delay": ["calibrate", "--delay", *ROBOT, "--emulated", "--rig", "wii.yaml"],
    "trial with faults": ["trial", *ROBOT, "--emulated", "--yes", "--speed", "inf", "--no-figures", "--evaluations", "1", *SMALL,
                          "--max-commands", "4", "--results", "faulty", "--faults", "faults.yaml", "--rig", "wii.yaml"],
}  # fmt: skip
FAULTS = "faults: [{kind: lost-reply, rate: 0.05}, {kind: lost-request, rate: 0.05}]\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("own") / "robot"
    assert main(["example", "robot", str(made)]) == 0
    announce(made, "my-robot", tomllib.loads((made / "pyproject.toml").read_text())["project"]["entry-points"])
    (made / "faults.yaml").write_text(FAULTS)
    camera = (made / "my_robot" / "rig.yaml").read_text().split("tracker:")[0]
    (made / "wii.yaml").write_text(f"{camera}tracker: {{kind: wii, height_m: 3.5, view_rad: 0.75}}\n")
    return made


@pytest.fixture(scope="module")
def done(folder):
    """Name -> exit code and output of each command, all in one process that finds the package on its path."""
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")]), str(Path.cwd())])
    (folder / "commands.py").write_text(SCRIPT)
    carried_out = subprocess.run(
        [sys.executable, "commands.py", json.dumps(COMMANDS)],
        cwd=folder, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert carried_out.returncode == 0, carried_out.stderr
    return json.loads(carried_out.stdout.splitlines()[-1])


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_goes_through(done, command):
    code, said, _ = done[command]
    assert code == (0 if command != "trial with faults" else code), said
    assert code in {0, 3}, said


def test_its_runs_are_stored_with_its_own_goal_radius(done, folder):
    rows = load(folder / "results")
    assert set(rows.robot) == {"my-robot"}
    assert set(rows.world) == {"physics"}
    assert len(rows) == 6
    assert rows["success_7cm"].isna().all()
    assert rows["success"].notna().all()


def test_its_ranges_are_its_own(done, folder):
    log = pd.read_csv(folder / "log.csv")
    assert 0.04 <= log.left_m_s.min() < 0.06
    assert 0.35 < log.left_m_s.max() <= 0.4


def test_the_diagnosis_finds_what_the_drawing_lacks(done):
    found = json.loads(done["diagnose"][1])
    assert found["verdict"] == "effects"
    assert "wheel-mismatch" in found["effects"] or "motor-lag" in found["effects"]


def test_its_trial_drove_and_stopped(done, folder):
    (journal,) = (folder / "driven" / "trials").glob("my-robot-*/journal.jsonl")
    assert all(e["confirmed"] for e in events(journal, "stop"))
    table = pd.read_csv(journal.with_name("measurements.csv"))
    assert len(table) > 5
    assert table.x_m.abs().max() < 1.9


def test_its_tracker_is_as_late_as_the_kernels_smoothing(done):
    late_ms = float(done["delay"][1].split("poses are ")[1].split(" ms")[0])
    assert -5.0 < late_ms < 35.0


@pytest.mark.parametrize("words", [["robot", "a", "b"], ["rover", "x"]])
def test_what_is_no_example_is_said(words, capsys):
    assert main(["example", *words]) == 2
    assert "bns example robot DIR" in capsys.readouterr().err


def test_nothing_is_written_over(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(Exception, match="is not empty"):
        copy_robot(tmp_path)
