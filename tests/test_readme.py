"""What the README shows can be typed as it stands."""

import re
import shlex
from pathlib import Path

import pytest

import bns as package
from bns.cli.main import _parser, main
from bns.sweep.expand.grid import load_sweep, parse_sweep
from bns.sweep.expand.order import ordered_specs

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text()
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", README, re.DOTALL)
COMMANDS = [
    shlex.split(line, comments=True)
    for kind, block in BLOCKS
    if kind == "sh"
    for line in block.splitlines()
    if re.match(r"(\.venv/bin/)?bns ", line)
]


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_commands_are_understood(command):
    assert _parser().parse_args(command[1:]).command


def test_sweep_example_is_a_sweep():
    page = (ROOT / "docs" / "sweeps.md").read_text()
    example = re.findall(r"```yaml\n(name:.*?)```", page, re.DOTALL)[0]
    assert parse_sweep(example, Path("sweeps.md")).total == 30 * (5 * 2 + 1)


def test_python_examples_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    quick = ["--evaluations", "1", "--population-size", "8", "--training-iterations-per-evaluation", "1"]
    assert main(["run", *quick, "--save-snn", "nets.safetensors"]) == 0
    names: dict = {}
    for example in [block for kind, block in BLOCKS if kind == "python"]:
        exec(example, names)
    assert list(names["modules"]) == ["dx", "dy", "dtheta"]
    assert len(names["evals"]) == len(names["runs"]) == 1
    assert names["bns"] is package


def test_make_targets_and_files_named_there_exist():
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert set(re.findall(r"(?:^|`)make ([a-z-]+)", README, re.MULTILINE)) <= targets
    for link in re.findall(r"\]\(([^)#]+)", README):
        assert (ROOT / link).exists(), link


@pytest.mark.parametrize("file", sorted((ROOT / "sweeps").glob("*.yaml")), ids=lambda f: f.stem)
def test_shipped_sweeps_can_be_read_and_are_named_after_their_file(file):
    sweep = load_sweep(file)
    assert sweep.name == file.stem
    totals = {"khepera": 45_000, "khepera-small": 480, "prototype": 9, "budget": 120}
    totals |= {"snake": 30_000, "snake-small": 200, "snake-balanced": 250, "snake-prototype": 20, "snake-changes": 6}
    totals |= {"approaches": 1200, "approaches-small": 48, "approaches-snake": 200, "approaches-tuning": 144}
    totals |= {"margin": 180, "options": 168, "worlds": 1440, "worlds-snake": 80, "random-behaviour": 80, "prototype-worlds": 180}
    totals |= {"noise": 240, "noise-physics": 90, "noise-tuning": 180, "noise-late": 120, "noise-late-tuning": 24}
    totals |= {"noise-ensemble": 180, "noise-polish": 120, "noise-polish-tuning": 144}
    totals |= {"readings": 300, "readings-exact-durations": 120, "readings-penalty-3m": 60}
    totals |= dict.fromkeys(("readings-one-component", "readings-cuts-inside", "readings-flat-spot"), 60)
    assert sweep.total == totals[file.stem]
    if sweep.total < 1000:
        assert len({spec.run_id for spec in ordered_specs(sweep)}) == sweep.total
