"""The walk-through of a missing effect, its commands taken from the page and carried out in order."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "missing-effect.md").read_text()
COMMANDS = re.findall(r"^(?:bns|python) .*$", "\n".join(re.findall(r"```sh\n(.*?)```", PAGE, flags=re.S)), flags=re.M)


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("walk")
    said = {}
    for command in COMMANDS:
        words = shlex.split(command)
        start = [sys.executable, "-m", "bns"] if words[0] == "bns" else [sys.executable]
        path = {"PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [*start, *words[1:]],
            cwd=folder,
            env={**os.environ, **path},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{command}\n{done.stderr}"
        said[command] = done.stdout
    return folder, said


def test_the_page_has_every_step():
    steps = ["-m", "compare", "diagnose", "report", "propose", "add", "add", "diagnose", "run"]
    assert [shlex.split(c)[1] for c in COMMANDS] == steps


def test_the_walk_ends_with_nothing_missing(outputs):
    folder, said = outputs
    found, mended = (said[c] for c in COMMANDS if " diagnose " in f" {c} ")
    assert found.startswith("verdict: effects\nMissing from the model: motor-lag.")
    assert mended.startswith("verdict: none")
    assert (folder / "worlds" / "figures" / "ladder.png").is_file()
    assert (folder / "worlds" / "drag.yaml").is_file()
    assert "the motors follow their commands with a lag" in (folder / "worlds" / "report.html").read_text()
    assert len((folder / "worlds" / "next.csv").read_text().splitlines()) > 10
