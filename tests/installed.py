"""A wheel of this checkout, built once for all workers of a test run, and the package installed from it."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

from filelock import FileLock

ROOT = Path(__file__).resolve().parent.parent
PARTS = ("bns", "analysis", "sweeps", "docs", "site_pages", "tests")
LEFT_BEHIND = shutil.ignore_patterns("__pycache__", "*.egg-info", "*.part")


def built(temporary: Path) -> Path:
    """Folder with the sdist and the wheel made of it, from a copy of the checkout: nothing is left in the checkout."""
    folder = temporary / "bns-build"
    with FileLock(temporary / "bns-build.lock"):
        if not (folder / "dist" / "done").exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            _build(folder)
            (folder / "dist" / "done").touch()
    return folder / "dist"


def installed(temporary: Path) -> Path:
    """A folder that holds the installed package alone."""
    wheel = wheel_in(built(temporary))
    folder = temporary / "bns-installed"
    with FileLock(temporary / "bns-installed.lock"):
        if not folder.exists():
            part = temporary / "bns-installed.part"
            with zipfile.ZipFile(wheel) as file:
                file.extractall(part)
            part.rename(folder)
    return folder


def wheel_in(folder: Path) -> Path:
    """The one wheel."""
    [path] = folder.glob("*.whl")
    return path


def without_us(*places: object) -> dict[str, str]:
    """The environment, with these places to find modules in instead of the checkout."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return kept | {"PYTHONPATH": os.pathsep.join(map(str, places))}


def shared_by_workers(tmp_path_factory) -> Path:
    """A temporary folder that all workers of pytest-xdist see."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base


def _build(folder: Path) -> None:
    for name in PARTS:
        shutil.copytree(ROOT / name, folder / name, ignore=LEFT_BEHIND)
    for file in ROOT.iterdir():
        if file.is_file() and not file.name.startswith("."):
            shutil.copy(file, folder / file.name)
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", "dist", "."]
    done = subprocess.run(
        command, cwd=folder, env=without_us(), capture_output=True, text=True, timeout=250, check=False
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
