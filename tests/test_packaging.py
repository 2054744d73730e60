"""The wheel and the sdist: what is in them, what they say of themselves, and that an installed bns lacks nothing."""

import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from contextlib import suppress
from email import message_from_string
from importlib import metadata

import pytest
from packaging.specifiers import SpecifierSet
from packaging.version import Version

import bns
from bns.extras import LIBRARIES
from tests.installed import ROOT, shared_by_workers, wheel_in, without_us
from tests.installed import built as make_dist
from tests.installed import installed as install

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Folder with the sdist, and the wheel that was made of it."""
    return make_dist(shared_by_workers(tmp_path_factory))


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder that holds the installed package alone."""
    return install(shared_by_workers(tmp_path_factory))


def files_of(part):
    return {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / part).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and path.suffix != ".pyc"
    }


@pytest.mark.slow
def test_the_wheel_holds_the_package_the_figures_and_the_sweeps_and_nothing_else(built):
    held = {name for name in zipfile.ZipFile(wheel_in(built)).namelist() if ".dist-info/" not in name}
    shipped = {f"bns/_shipped/{name}" for part in ("analysis", "sweeps") for name in files_of(part)}
    assert held == files_of("bns") | shipped
    assert wheel_in(built).stat().st_size < 5e6


@pytest.mark.slow
def test_the_sdist_holds_what_the_wheel_is_made_of_and_the_tests(built):
    [path] = built.glob("*.tar.gz")
    with tarfile.open(path) as file:
        held = {name.partition("/")[2] for name in file.getnames()}
    assert files_of("bns") | files_of("analysis") | files_of("sweeps") <= held
    assert {
        "pyproject.toml",
        "setup.py",
        "constraints.txt",
        "LICENSE",
        "CHANGELOG.md",
        "tests/test_packaging.py",
    } <= held
    assert not any(name.endswith(".pyc") for name in held)


@pytest.mark.slow
def test_the_metadata_say_what_is_needed_and_where_it_runs(built):
    with zipfile.ZipFile(wheel_in(built)) as file:
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
    assert not core & {
        "torch",
        "mujoco",
        "imageio-ffmpeg",
        "opencv-python-headless",
        "pyserial",
        "dynamixel-sdk",
        "statsmodels",
    }
    assert {"numpy", "numba", "scikit-learn", "shtab"} <= core
    assert set(said.get_all("Provides-Extra")) == set(EXTRAS)


def test_each_library_that_an_error_names_comes_with_its_extra():
    packages = {"cv2": "opencv-python-headless", "serial": "pyserial"}
    for extra, libraries in LIBRARIES.items():
        named = {re.match(r"[\w-]+", one).group() for one in EXTRAS[extra]}
        assert named == {packages.get(library, library.replace("_", "-")) for library in libraries}
    [everything] = EXTRAS["all"]
    assert set(re.search(r"\[(.*)\]", everything).group(1).split(",")) == set(LIBRARIES)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "answer"),
    [
        ("import bns; print(bns.__file__)", "{place}/bns/__init__.py"),
        ("from bns.plotting.scripts import scripts; print(scripts())", "{place}/bns/_shipped"),
        ("from bns.sweep.expand.grid import load_sweep; print(load_sweep('khepera').total)", "45000"),
        ("from bns.tasks import task_names; print(*task_names('snake'))", "three-regions two-regions"),
        ("from bns.robots.simulator import load_static_simulator as f; print(len(f('snake').networks) > 0)", "True"),
        ("from bns.examples import copy_example as f; print(len(f('new')))", "7"),
    ],
)
def test_what_is_installed_finds_its_parts(installed, tmp_path, code, answer):
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=without_us(installed),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.strip() == answer.format(place=installed), done.stderr


@pytest.mark.slow
def test_figures_are_drawn_from_what_is_installed(installed, tmp_path):
    command = [sys.executable, "-m", "bns", "figures", "--results", "none"]
    done = subprocess.run(
        command, cwd=tmp_path, env=without_us(installed), capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 2, done.stderr
    assert "bns: there are no runs in" in done.stderr


def test_what_setup_pins_runs_on_the_oldest_python_that_is_promised():
    """A pin that needs a later bug-fix release of Python ends setup on a distribution's own Python (Debian 12: 3.11.2)."""
    oldest = Version(PROJECT["requires-python"].removeprefix(">=") + ".0")
    pins = [line.split("==")[0] for line in (ROOT / "constraints.txt").read_text().splitlines() if "==" in line]
    needs = {}
    for name in pins:
        with suppress(metadata.PackageNotFoundError):
            needs[name] = metadata.metadata(name).get("Requires-Python") or ""
    assert len(needs) > 100
    assert {name: needed for name, needed in needs.items() if not SpecifierSet(needed).contains(oldest)} == {}
