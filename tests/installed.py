"""A wheel of this checkout, built once for all workers of a test run, and the package installed from it."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

from filelock import FileLock
from numba.core.caching import _CacheLocator

from bns.engine.jit import cache_folder

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
            _take_over_kernels(folder)
    return folder


def _take_over_kernels(folder: Path) -> None:
    """Kernels that the checkout has compiled, of the same text, serve the installed package: compiling them is tested elsewhere.

    Numba keeps them in a folder named after that of the source, and takes those of a file with the same date and size.
    """
    old, new = ROOT / "bns", folder / "bns"
    theirs = new / "__pycache__" / cache_folder().name
    for source in new.rglob("*.py"):
        original = old / source.relative_to(new)
        if not original.exists():  # the figures and sweeps that are shipped have no kernels
            continue
        date = original.stat()
        os.utime(source, ns=(date.st_atime_ns, date.st_mtime_ns))
        compiled, subpath = (cache_folder() / _CacheLocator.get_suitable_cache_subpath(str(f)) for f in (original, source))
        if compiled.is_dir() and not (theirs / subpath.name).is_dir():
            for kind in ("nbc", "nbi"):  # the index last: it names the others
                for file in compiled.glob(f"*.{kind}"):
                    (theirs / subpath.name).mkdir(parents=True, exist_ok=True)
                    shutil.copy(file, theirs / subpath.name)


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
        command, cwd=folder, env=without_us(), capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
