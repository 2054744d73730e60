"""The circle from a run to controllers of an extended model: the page's commands in order, with fewer and smaller runs."""

import re
import shlex
import shutil
from pathlib import Path

import pytest
import yaml

from analysis.transfer.__main__ import main as transfer
from bns.cli.main import main as bns

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "closing-the-gap.md").read_text()
COMMANDS = re.findall(r"^.+$", "\n".join(re.findall(r"```sh\n(.*?)```", PAGE, flags=re.S)), flags=re.M)
SMALL = {"population_size": 20, "training_iterations_per_evaluation": 20, "generations_per_evaluation": 2}
SMALLER_RUN = [word for name, value in SMALL.items() for word in (f"--{name.replace('_', '-')}", str(value))]


@pytest.fixture(scope="module")
def walked(tmp_path_factory):
    """The folder and exit codes of the page's commands, all carried out in this process."""
    folder = tmp_path_factory.mktemp("gap")
    shutil.copytree(ROOT / "docs" / "closing-the-gap", folder / "docs" / "closing-the-gap")
    for name in ("before", "after", "direct"):
        sweep = folder / "docs" / "closing-the-gap" / f"{name}.yaml"
        spec = yaml.safe_load(sweep.read_text())
        spec["fixed"] |= SMALL | {"evaluations": 3}
        sweep.write_text(yaml.safe_dump(spec | {"seeds": 1}))
    with pytest.MonkeyPatch.context() as here:
        here.chdir(folder)
        codes = [carried_out(shlex.split(command)) for command in COMMANDS]
    return folder, codes


def carried_out(words):
    if words[:2] == ["mkdir", "-p"]:
        Path(words[2]).mkdir(parents=True)
        return 0
    if words[:3] == ["python", "-m", "analysis.transfer"]:
        return transfer(words[3:])
    assert words[0] == "bns"
    return bns([*words[1:], *{"run": SMALLER_RUN, "sweep": ["--jobs", "1"]}.get(words[1], [])])


def test_the_page_and_the_target_of_make_are_the_same_commands():
    target = re.search(r"^closing-the-gap:.*?\n\n", (ROOT / "Makefile").read_text(), flags=re.S | re.M).group().strip()
    lines = target.replace("\\\n", " ").splitlines()[1:]
    known = {"$(BIN)/": "", "$(GAP)": "docs/closing-the-gap", "$(OUT)": "results/closing-the-gap", "@": ""}
    for short, long in known.items():
        lines = [line.replace(short, long) for line in lines]
    assert [shlex.split(line) for line in lines] == [shlex.split(command) for command in COMMANDS]


def test_every_command_of_the_page_works_in_its_order(walked):
    folder, codes = walked
    assert codes == [0] * len(COMMANDS)
    extended = yaml.safe_load((folder / "results/closing-the-gap/extended.yaml").read_text())
    found = {effect["name"]: effect["values"] for effect in extended["effects"]}
    assert found["wheel-mismatch"]["ratio"] == pytest.approx(1.05, abs=0.005)
    assert found["motor-lag"]["tau_s"] == pytest.approx(0.2, abs=0.02)
    assert (folder / "results/closing-the-gap/figures/transfer.png").is_file()
    labels = (folder / "results/closing-the-gap/figures/transfer-summary.csv").read_text()
    assert all(f"gap-{name}" in labels for name in ("before", "after", "direct"))


def test_the_page_adds_what_its_robot_hides_and_the_two_differ_in_nothing_else():
    robot, drawing = (
        yaml.safe_load((ROOT / f"docs/closing-the-gap/{name}.yaml").read_text()) for name in ("robot", "drawing")
    )
    assert {**robot, "effects": None} == {**drawing, "effects": None}
    (add,) = (shlex.split(command) for command in COMMANDS if command.startswith("bns add"))
    assert add[3 : add.index("--model")] == [effect["name"] for effect in robot["effects"]]
