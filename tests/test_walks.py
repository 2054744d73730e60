"""The pages for newcomers, followed literally: a wheel in an empty folder, each command typed as it stands."""

import re
import shlex
import subprocess
import sys
import textwrap
from pathlib import Path

import pandas as pd
import pytest
import yaml

from bns.cli.main import _parser, main
from tests.conftest import remembering
from tests.installed import ROOT, installed, shared_by_workers, without_us
from tests.typist import Typist

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1200)]  # a page is many commands, and the first of each kind compiles
DOCS = ROOT / "docs"
BLOCK = re.compile(r"^([ ]*)```(\w+)\n(.*?)^\1```$", flags=re.S | re.M)
SET_UP = ("pip ", "python3 -m venv", "python -m venv", ". ")
"""What the fixture has done already: the environment and the wheel in it."""
FILES = {"python", "yaml"}


class Walk:
    """A person in an empty folder with an installed bns, who types what pages say."""

    def __init__(self, folder, package, typist):
        self.folder, self.package, self.typist, self.said = folder, package, typist, {}

    def follow(self, page):
        """Write the files and type the commands of a page of docs/, in its order; a command that was typed before is skipped."""
        for indent, kind, text in BLOCK.findall((DOCS / page).read_text()):
            block = textwrap.dedent(text) if indent else text
            if kind in FILES and (named := re.match(r"# (\S+\.(?:py|yaml))\n", block)):
                (self.folder / named[1]).write_text(block)
            elif kind == "sh":
                for line in block.replace("\\\n", " ").splitlines():
                    self.type(line.strip())
        return self

    def type(self, line):
        """One line of a shell."""
        if not line or line.startswith(SET_UP) or line in self.said:
            return
        words, self.said[line] = shlex.split(line, comments=True), ""
        if words[0] == "cd":
            self.folder /= words[1]
        elif words[:2] == ["bns", "explore"]:  # it serves until it is stopped: tests/app goes through it
            assert _parser().parse_args(words[1:]).command
        else:
            self.said[line] = self.output(words)

    def output(self, words):
        """What a command prints; it must end with 0."""
        if words[0] == "bns":
            code, out, err = self.typist.type(words[1:], self.folder)
        else:
            done = subprocess.run(
                [{"python": sys.executable}[words[0]], *words[1:]],
                cwd=self.folder, env=without_us(self.package), capture_output=True, text=True, timeout=600, check=False,
            )  # fmt: skip
            code, out, err = done.returncode, done.stdout, done.stderr
        assert code == 0, f"{shlex.join(words)}\n{out}\n{err}"
        assert "Traceback" not in err
        return out


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    return installed(shared_by_workers(tmp_path_factory))


@pytest.fixture(scope="module")
def typist(package):
    one = Typist(without_us(package) | remembering())
    yield one
    one.close()


@pytest.fixture
def walk(tmp_path, package, typist):
    return Walk(tmp_path, package, typist)


@pytest.fixture
def small_walk(walk):
    """In a sample folder whose sweep is shorter."""
    assert main(["example", str(walk.folder / "my-first")]) == 0
    walk.folder /= "my-first"
    sweep = walk.folder / "my-sweep.yaml"
    sweep.write_text(sweep.read_text().replace("evaluations: 30", "evaluations: 21").replace("[50, 200]", "[20, 40]"))
    return walk


def shown(page):
    """What a page shows of an answer: its blocks of text."""
    return [text for _, kind, text in BLOCK.findall((DOCS / page).read_text()) if kind == "text"]


def test_commands_are_those_of_the_installed_package(typist, package):
    assert typist.package == package / "bns"


def test_a_newcomer_names_the_effect(walk):
    walk.follow("quick-start.md")
    first, after = (said for line, said in walk.said.items() if "bns diagnose" in line)
    [answer] = shown("quick-start.md")
    assert first.startswith(answer)
    assert after.startswith("verdict: none")
    assert "motors follow their commands with a lag" in (walk.folder / "report.html").read_text()

    walk.follow("tutorials/find-an-effect.md")
    plan = pd.read_csv(walk.folder / "next.csv")
    assert len(plan) > 10
    assert {"trial", "left_m_s", "right_m_s", "duration_s"} <= set(plan)

    walk.follow("missing-effect.md")
    assert (walk.folder / "figures" / "ladder.png").is_file()
    assert (walk.folder / "drag.yaml").is_file()


def test_the_front_page_shows_what_the_sample_says(walk):
    """The numbers of the front page are those of the quick start's first diagnosis, in its own lines."""
    [front] = shown("index.md")
    [quick] = shown("quick-start.md")
    assert front.startswith(quick)
    assert "56.12 (28.68)" in front
    numbers = (DOCS / "explain" / "numbers.md").read_text()
    assert "56.12 (28.68)" in numbers
    assert "138.256" in numbers


def test_a_sweep_and_its_figures(small_walk):
    small_walk.follow("tutorials/sweep.md")
    assert (small_walk.folder / "results" / "figures" / "index.html").is_file()
    query = next(said for line, said in small_walk.said.items() if line.startswith("bns query"))
    assert "success" in query
    assert len(query.splitlines()) > 4


def test_many_machines(small_walk):
    small_walk.follow("tutorials/cluster.md")
    status = small_walk.said["bns status --results shared"]
    assert re.search(r"my-sweep\s+circle\s+12\s+12 ", status)


def test_a_trial_on_emulated_hardware(walk):
    walk.follow("tutorials/trial.md")
    [folder] = (walk.folder / "results" / "trials").glob("khepera-circle-0-*-emulated")
    page = (DOCS / "tutorials" / "trial.md").read_text()
    for name in re.findall(r"^\| `([\w./]+)` \|", page, flags=re.M):
        assert (folder / name).is_file(), name
    broken, resumed = (
        shlex.split(line)[1:] for line in "\n".join(shown("tutorials/trial.md")).splitlines() if "--seed 3" in line
    )
    code, _, said = walk.typist.type(broken, walk.folder)
    assert code == 3
    assert re.search(r"planned faults that happened: (lost-reply.*, )?hang-up at 3 s", said)
    assert walk.typist.type(resumed, walk.folder)[0] == 0


def test_a_robot_of_ones_own(walk):
    walk.follow("tutorials/own-robot.md")
    found = walk.said["bns diagnose my-log.csv --model my-robot.yaml"]
    assert found.startswith("verdict: effects\nMissing from the model: turn-slip.")
    [effect] = yaml.safe_load((walk.folder / "extended.yaml").read_text())["effects"]
    assert effect["values"]["slip_s"] == pytest.approx(0.12, abs=0.005)


def test_an_effect_of_ones_own(small_walk):
    small_walk.follow("tutorials/own-effect.md")
    said = small_walk.said
    beside = next(text for line, text in said.items() if line.startswith("bns diagnose khepera-log.csv"))
    assert beside.startswith("verdict: effects\nMissing from the model: motor-lag.")
    found = next(text for line, text in said.items() if line.startswith("bns diagnose loss.csv"))
    assert found.startswith("verdict: effects\nMissing from the model: left-turn-loss.")


def test_every_command_of_the_tutorials_is_understood():
    pages = [
        "index.md",
        "quick-start.md",
        *(f"tutorials/{page.name}" for page in Path(DOCS / "tutorials").glob("*.md")),
    ]
    for page in pages:
        for _, kind, text in BLOCK.findall((DOCS / page).read_text()):
            for line in textwrap.dedent(text).replace("\\\n", " ").splitlines():
                if kind in {"sh", "text"} and line.startswith("bns "):
                    assert _parser().parse_args(shlex.split(line, comments=True)[1:]).command, (page, line)
