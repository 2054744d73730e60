"""A package outside the tree adds a part of every kind, and the commands use them: the package of docs/extending.md."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from bns.registry import EFFECTS, EXECUTORS, FIGURES, PLATFORMS, ROBOTS, TRACKERS, WORLDS
from bns.store.read.reader import load
from bns.tasks import TASKS
from tests.plugins.package import blocks, entry_points, install

pytestmark = pytest.mark.slow

SMALL = [
    *("--population-size", "20", "--training-iterations-per-evaluation", "10", "--generations-per-evaluation", "1"),
    *("--real-world-selection-size", "0.1"),
]
ROVER = ["--robot", "rover"]
IDEAL = "base: differential-drive\nwheelbase_m: 0.12\n"
SWEEP = """
name: gates
robot: rover
seeds: 1
fixed: {evaluations: 2, population_size: 20, training_iterations_per_evaluation: 10, generations_per_evaluation: 1,
        world: slippery}
grid: {task: [gate, wall]}
"""
COMMANDS = {
    "run": ["run", *ROVER, "--task", "gate", "--world", "slippery", "--evaluations", "2", *SMALL, "--results", "results"],
    "log": ["run", *ROVER, "--task", "wall", "--world", "physics", "--evaluations", "30", *SMALL, "--results", "logged",
            "--max-commands", "10", "--measurements", "log.csv"],
    "sweep": ["sweep", "gates.yaml", "--executor", "gentle", "--jobs", "1", "--results", "results"],
    "diagnose": ["diagnose", "log.csv", "--model", "ideal.yaml", "--json"],
    "report": ["report", "log.csv", "--model", "ideal.yaml", "-o", "report.html", "--minutes", "1"],
    "trial": ["trial", *ROVER, "--task", "wall", "--emulated", "--yes", "--speed", "inf", "--no-figures", "--evaluations", "1",
              *SMALL, "--results", "driven"],
    "figure": ["-m", "analysis", "--results", "results", "--only", "hours"],
}  # fmt: skip
SCRIPT = """
import contextlib, io, json, sys, time
from bns.cli.main import main
from analysis.__main__ import main as draw
if __name__ == "__main__":
    done = {}
    for name, words in json.loads(sys.argv[1]).items():
        out, began = io.StringIO(), time.process_time()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            code = draw(words[2:]) if words[0] == "-m" else main(words)
        done[name] = [code, out.getvalue(), time.process_time() - began]
    print(json.dumps(done))
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("stranger")
    install(made / "site")
    (made / "ideal.yaml").write_text(IDEAL)
    (made / "gates.yaml").write_text(SWEEP)
    return made


@pytest.fixture(scope="module")
def done(folder):
    """Name -> exit code and output of each command, all in one process that finds the package on its path."""
    path = os.pathsep.join([str(folder / "site"), *filter(None, [os.environ.get("PYTHONPATH")]), str(Path.cwd())])
    script = folder / "commands.py"
    script.write_text(SCRIPT)
    carried_out = subprocess.run(
        [sys.executable, str(script), json.dumps(COMMANDS)],
        cwd=folder, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert carried_out.returncode == 0, carried_out.stderr
    return json.loads(carried_out.stdout.splitlines()[-1])


def test_the_page_has_an_example_of_every_kind():
    kinds = {EFFECTS, WORLDS, ROBOTS, TASKS, TRACKERS, PLATFORMS, EXECUTORS, FIGURES}
    assert set(entry_points()) == {kind.group for kind in kinds}
    assert len(blocks()) == 12


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_goes_through_with_the_strangers_parts(done, command):
    code, said, _ = done[command]
    assert code == 0, said


def test_runs_of_the_strangers_robot_in_its_world_are_stored(done, folder):
    rows = load(folder / "results")
    assert set(rows.robot) == {"rover"}
    assert set(rows.task) == {"gate", "wall"}
    assert set(rows.world) == {"slippery"}
    assert len(rows[rows["sweep"] == "gates"]) == 4


def test_the_strangers_effect_is_found_in_what_its_robot_did(done):
    found = json.loads(done["diagnose"][1])
    assert found["verdict"] == "effects"
    assert "left-turn-loss" in found["effects"]


def test_the_report_has_the_strangers_words(done, folder):
    page = (folder / "report.html").read_text()
    assert "the robot turns less to the left than commanded" in page


def test_the_strangers_tracker_saw_the_trial(done, folder):
    (measured,) = (folder / "driven" / "trials").glob("rover-*/measurements.*")
    table = pd.read_csv(measured) if measured.suffix == ".csv" else pd.read_parquet(measured)
    assert len(table) > 5
    assert table.x_m.abs().max() < 0.9


def test_the_strangers_figure_is_drawn(done, folder):
    assert (folder / "results" / "figures" / "hours.png").is_file()
    assert len(pd.read_csv(folder / "results" / "figures" / "hours.csv")) == 3
