"""The wheel and the sdist: what is in them, what they say of themselves, and that an installed bns lacks nothing."""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email import message_from_string
from pathlib import Path

import pytest

import bns
from bns.extras import LIBRARIES

ROOT = Path(__file__).resolve().parent.parent
PARTS = ("bns", "analysis", "sweeps", "docs", "tests")
LEFT_BEHIND = shutil.ignore_patterns("__pycache__", "*.egg-info", "*.part")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Folder with the sdist, and the wheel that was made of it, from a copy: nothing is left in the checkout."""
    folder = tmp_path_factory.mktemp("build")
    for name in PARTS:
        shutil.copytree(ROOT / name, folder / name, ignore=LEFT_BEHIND)
    for file in ROOT.iterdir():
        if file.is_file() and not file.name.startswith("."):
            shutil.copy(file, folder / file.name)
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", "dist", "."]
    done = subprocess.run(command, cwd=folder, env=without_us(), capture_output=True, text=True, timeout=200, check=False)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return folder / "dist"


@pytest.fixture(scope="module")
def installed(built, tmp_path_factory):
    """A folder that holds the installed package alone."""
    folder = tmp_path_factory.mktemp("site-packages")
    with zipfile.ZipFile(wheel(built)) as file:
        file.extractall(folder)
    return folder


def wheel(built):
    [path] = built.glob("*.whl")
    return path


def without_us(*places):
    """The environment, with these places to find modules in instead of the checkout."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | {
        "PYTHONPATH": os.pathsep.join(map(str, places))
    }


def files_of(part):
    return {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / part).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and path.suffix != ".pyc"
    }


def test_the_wheel_holds_the_package_the_figures_and_the_sweeps_and_nothing_else(built):
    held = {name for name in zipfile.ZipFile(wheel(built)).namelist() if ".dist-info/" not in name}
    shipped = {f"bns/_shipped/{name}" for part in ("analysis", "sweeps") for name in files_of(part)}
    assert held == files_of("bns") | shipped
    assert wheel(built).stat().st_size < 5e6


def test_the_sdist_holds_what_the_wheel_is_made_of_and_the_tests(built):
    [path] = built.glob("*.tar.gz")
    with tarfile.open(path) as file:
        held = {name.partition("/")[2] for name in file.getnames()}
    assert files_of("bns") | files_of("analysis") | files_of("sweeps") <= held
    assert {"pyproject.toml", "setup.py", "constraints.txt", "LICENSE", "CHANGELOG.md", "tests/test_packaging.py"} <= held
    assert not any(name.endswith(".pyc") for name in held)


def test_the_metadata_say_what_is_needed_and_where_it_runs(built):
    with zipfile.ZipFile(wheel(built)) as file:
        [name] = [name for name in file.namelist() if name.endswith(".dist-info/METADATA")]
        said = message_from_string(file.read(name).decode())
        [entry] = [name for name in file.namelist() if name.endswith("entry_points.txt")]
        assert "bns = bns.__main__:main" in file.read(entry).decode()
    assert said["Version"] == bns.__version__ == "0.2.0"
    assert said["License-Expression"] == "MIT"
    assert said["Author"]
    assert said.get_all("Project-URL")
    kinds = said.get_all("Classifier")
    assert {"Operating System :: POSIX :: Linux", "Operating System :: MacOS"} <= set(kinds)
    assert not any("Windows" in kind for kind in kinds)
    core = {re.match(r"[\w-]+", one).group() for one in said.get_all("Requires-Dist") if "extra ==" not in one}
    assert not core & {"torch", "mujoco", "imageio-ffmpeg", "opencv-python-headless", "pyserial", "dynamixel-sdk", "statsmodels"}
    assert {"numpy", "numba", "scikit-learn", "shtab"} <= core
    assert set(said.get_all("Provides-Extra")) == set(EXTRAS)


def test_each_library_that_an_error_names_comes_with_its_extra():
    packages = {"cv2": "opencv-python-headless", "serial": "pyserial"}
    for extra, libraries in LIBRARIES.items():
        named = {re.match(r"[\w-]+", one).group() for one in EXTRAS[extra]}
        assert named == {packages.get(library, library.replace("_", "-")) for library in libraries}
    [everything] = EXTRAS["all"]
    assert set(re.search(r"\[(.*)\]", everything).group(1).split(",")) == set(LIBRARIES)


@pytest.mark.parametrize(
    ("code", "answer"),
    [
        ("import bns; print(bns.__file__)", "{place}/bns/__init__.py"),
        ("from bns.plotting.scripts import scripts; print(scripts())", "{place}/bns/_shipped"),
        ("from bns.sweep.expand.grid import load_sweep; print(load_sweep('khepera').total)", "45000"),
        ("from bns.tasks import task_names; print(*task_names('snake'))", "three-regions two-regions"),
        ("from bns.robots.simulator import load_static_simulator as f; print(len(f('snake').networks) > 0)", "True"),
        ("from bns.examples import copy_example as f; print(len(f('new')))", "5"),
    ],
)
def test_what_is_installed_finds_its_parts(installed, tmp_path, code, answer):
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=without_us(installed), capture_output=True, text=True, check=False
    )
    assert done.stdout.strip() == answer.format(place=installed), done.stderr


def test_figures_are_drawn_from_what_is_installed(installed, tmp_path):
    command = [sys.executable, "-m", "bns", "figures", "--results", "none"]
    done = subprocess.run(
        command, cwd=tmp_path, env=without_us(installed), capture_output=True, text=True, timeout=100, check=False
    )
    assert done.returncode == 2, done.stderr
    assert "error: there are no runs in" in done.stderr
