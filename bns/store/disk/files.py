"""Names and places of result files, and the few durable steps that they are changed by.

A file is built in ``staging/``, synced, moved to its place by ``os.replace`` and never written again.
"""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bns.errors import StoreError

JOURNAL, STAGING, SET_ASIDE = "journal", "staging", "set-aside"

_COPY = ".copy"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_NO_FOLDER = {errno.ENOTDIR, errno.EEXIST}
_LOCKED_OUT = {errno.EROFS, errno.EACCES, errno.EPERM}


class StoreWarning(UserWarning):
    """Something in the results was passed over; the message names the file."""


def is_name(text: str) -> bool:
    """Whether ``text`` can be the name of a sweep or task."""
    return _NAME.fullmatch(text) is not None


def checked_name(kind: str, name: str) -> str:
    """``name`` if it can stand in a folder name; StoreError otherwise."""
    if not is_name(name):
        raise StoreError(
            f"{kind} {name!r} cannot be a folder name: it must begin with a letter and hold "
            "only letters, digits, - and _. Rename it."
        )
    return name


def partition(results: Path, table: str, sweep: str, task: str) -> Path:
    """Folder of the parts of one table, sweep and task."""
    return results / table / f"sweep={sweep}" / f"task={task}"


@contextmanager
def explained(action: str, path: Path) -> Iterator[None]:
    """Turn an OSError into a StoreError that says what could not be done, where, and what to do next."""
    try:
        yield
    except OSError as error:
        obstacle = _obstacle(path) if error.errno in _NO_FOLDER else None
        if obstacle is not None:
            reason, remedy = f"{obstacle} is a file.", "give a folder (--results DIR for results, -o FILE for a file)."
        elif error.errno in _FULL:
            reason, remedy = (
                "The disk, quota or file size limit is full.",
                "free some space and repeat the command (a sweep continues where it stopped).",
            )
        elif error.errno in _LOCKED_OUT:
            reason, remedy = (
                "The folder is read-only for this user.",
                "make it writable, or give another place (--results DIR for results, -o FILE for a file).",
            )
        elif error.errno == errno.ENOENT and path.parent.is_dir():
            reason, remedy = f"Nothing can be made in the folder {path.parent}.", "choose another folder."
        else:
            reason, remedy = "", "look after the disk and repeat the command."
        why = f"{error.strerror or error}.{' ' * bool(reason)}{reason}"
        raise StoreError(f"cannot {action} {path}: {why} Nothing that was finished is lost: {remedy}") from error


def what_is_there(results: Path) -> str:
    """Why nothing can be read from ``results``, to follow its name: it is a file, does not exist, is empty, ..."""
    obstacle = _obstacle(results)
    if obstacle is not None:
        return f"{obstacle} is a file, not a folder"
    if not results.is_dir():
        return "the folder does not exist"
    if any(results.glob("journal.jsonl")) or any((results / "trials").glob("*/journal.jsonl")):
        return (
            "the folder holds trials alone, and a trial is stored when it is complete: go on with it by bns trial --resume, or "
            "store what was driven by bns trial --replay JOURNAL"
        )
    return "nothing in the folder can be read as results" if any(results.iterdir()) else "the folder is empty"


def is_same(path: Path, known: os.stat_result) -> bool:
    """Whether ``path`` still is the file that ``known`` describes, neither deleted nor moved nor replaced."""
    try:
        return os.path.samestat(path.stat(), known)
    except (FileNotFoundError, NotADirectoryError):
        return False


def gone(path: Path, lost: str) -> StoreError:
    """The error of a writer under whom ``path`` was taken away; ``lost`` says what was in it."""
    return StoreError(
        f"{path} is missing: the results were deleted or moved while they were being written. {lost} "
        "Run the sweep again: it carries out the missing runs. If the folder was moved, move it back first or name its "
        "new place with --results DIR; and leave it alone while a sweep is running."
    )


def make_folder(folder: Path) -> None:
    """Create ``folder`` with its parents, durably."""
    with explained("create the folder", folder):
        missing = [place for place in (folder, *folder.parents) if not place.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        for place in missing:
            _sync_folder(place.parent)


def write_all(descriptor: int, data: bytes) -> None:
    """Write every byte of ``data``: one os.write may stop short."""
    rest = memoryview(data)
    while rest:
        rest = rest[os.write(descriptor, rest) :]


def publish(data: bytes, staged: Path, place: Path) -> None:
    """Let a file with ``data`` appear at ``place`` all at once and for good; it is built at ``staged``."""
    make_folder(staged.parent)
    make_folder(place.parent)
    try:
        with explained("write", place if staged.parent == place.parent else staged):
            _write_synced(staged, data)
        with explained("publish", place):
            _replace(staged, place)
            _sync_folder(place.parent)
    except StoreError:
        # What is half written would take the space that the user now has to find.
        _forget(staged)
        raise


def remove(path: Path) -> None:
    """Delete ``path`` durably; one that is gone already is no fault."""
    with explained("remove", path):
        path.unlink(missing_ok=True)
        _sync_folder(path.parent)


def set_aside(results: Path, path: Path, data: bytes | None = None) -> Path:
    """Move ``path`` (or only copy its ``data``) to the same place below ``set-aside/``; the new path."""
    home = results / SET_ASIDE / path.relative_to(results)
    place, count = home, 0
    while place.exists():
        count += 1
        place = home.with_name(f"{home.name}.{count}")
    make_folder(place.parent)
    with explained("set aside", path):
        if data is None:
            _replace(path, place)
            _sync_folder(path.parent)
        else:
            _write_synced(place, data)
        _sync_folder(place.parent)
    return place


def on_the_way(results: Path, sweep: str) -> list[Path]:
    """What a killed writer of ``sweep`` left half copied beside its place, in tables that lie on another disk."""
    return sorted(results.glob(f"*/sweep={sweep}/**/.*{_COPY}"))


def _replace(path: Path, place: Path) -> None:
    """``os.replace``, also where a folder of ``place`` is a link to another disk."""
    try:
        os.replace(path, place)  # noqa: PTH105 - the tests stop a writer at this very call
    except OSError as error:
        if error.errno != errno.EXDEV:
            raise
        near = place.with_name(f".{place.name}{_COPY}")
        _write_synced(near, path.read_bytes())
        os.replace(near, place)  # noqa: PTH105
        path.unlink()


def _write_synced(path: Path, data: bytes) -> None:
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
    try:
        write_all(descriptor, data)
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _obstacle(path: Path) -> Path | None:
    # The one of path and its parents that is a file where a folder is wanted.
    return next((place for place in (path, *path.parents) if place.is_file()), None)


def _forget(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError:
        return  # the first fault is the one to report; the next writer clears staging
