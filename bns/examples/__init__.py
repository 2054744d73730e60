"""Files to begin with: a sample log, a sweep, notebooks and a script, copied into a folder of the user's."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bns.errors import BnsError

FOLDER = Path(__file__).resolve().parent / "files"
ROBOT = Path(__file__).resolve().parent / "robot"
FILES = (
    *("README.md", "khepera-log.csv", "khepera-log.csv.import.yaml", "diagnosis.ipynb"),
    *("my-sweep.yaml", "sweep.ipynb", "example.py"),
)


def copy_example(folder: str | Path) -> list[Path]:
    """Copy the files to begin with into ``folder``, which is made if it is missing; return their new paths.

    Raises:
        BnsError: ``folder`` is a file, or not empty, or cannot be written; nothing is overwritten, nothing left half.
    """
    with _whole(folder) as new:
        return [Path(shutil.copy(FOLDER / name, new / name)) for name in FILES]


def copy_robot(folder: str | Path) -> list[Path]:
    """Copy the package of a robot of one's own likewise: README first, then all other files."""
    with _whole(folder) as new:
        for file in sorted(ROBOT.rglob("*")):
            if file.is_file() and "__pycache__" not in file.parts:
                (new / file.relative_to(ROBOT)).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(file, new / file.relative_to(ROBOT))
    return sorted((file for file in new.rglob("*") if file.is_file()), key=lambda file: (file.name != "README.md", str(file)))


@contextmanager
def _whole(folder: str | Path) -> Iterator[Path]:
    """The folder, made if it is missing. If it cannot be filled it is left empty, and BnsError names it."""
    new = _emptied(folder)
    try:
        yield new
    except OSError as error:
        for file in new.iterdir():
            shutil.rmtree(file) if file.is_dir() else file.unlink()
        raise BnsError(f"cannot write into {new}: {error.strerror}. Make room there, or name another folder.") from error


def _emptied(folder: str | Path) -> Path:
    """The folder, made if it is missing; BnsError if it cannot be begun in."""
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise BnsError(f"{folder} is a file; give a folder that is new or empty.")
    if folder.is_dir() and any(folder.iterdir()):
        raise BnsError(f"the folder {folder} is not empty, and nothing is overwritten; give one that is new or empty.")
    folder.mkdir(parents=True, exist_ok=True)
    return folder
