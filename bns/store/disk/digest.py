"""A SHA-256 in every parquet part, over all of the file but the digest itself, and what was verified before.

The digest stands in the part's own metadata, so that it goes wherever the file is copied to. The metadata of a "runs"
part, which is published last, names the digests of the other tables of its fold: nothing can be lost or exchanged.
"""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

FIELD = "digest"
_MARK = b'"digest": "'
_LENGTH = 64
BLANK = "0" * _LENGTH
"""What stands in the place of the digest while it is computed."""
_FOOTER_MOST = 1 << 20
_CHUNK = 1 << 20
_REMEMBER_FROM = 32 << 20
"""Bytes that were read anew from which on the next process should be spared them."""

Identity = tuple[int, int, int, int]


def sealed(data: bytes) -> bytes:
    """A parquet file with `BLANK` as its digest, with the digest filled in."""
    at = _place_of(data)
    digest = hashlib.sha256(data).hexdigest().encode()
    return data[:at] + digest + data[at + _LENGTH :]


def digest_in(data: bytes) -> str:
    """The digest that a sealed file names."""
    at = _place_of(data)
    return data[at : at + _LENGTH].decode()


def is_sealed(path: Path) -> bool:
    """Whether a file names a digest at all; older ones do not."""
    return _stated(path)[0] >= 0


def is_intact(path: Path) -> bool:
    """Whether a sealed file is, byte for byte, what was written; reads all of it."""
    at, stated = _stated(path)
    digest, position = hashlib.sha256(), 0
    with path.open("rb") as file:
        while chunk := file.read(_CHUNK):
            digest.update(_blanked(chunk, at - position))
            position += len(chunk)
    return digest.hexdigest().encode() == stated


def identity(stat: os.stat_result) -> Identity:
    """Size, times and inode: as long as they stay, the file counts as unchanged."""
    return stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns, stat.st_ino


class Memory:
    """Files of one folder of results that were found intact, kept in the user's cache for the next process.

    It saves time alone: where it cannot be read or written, files are verified once a process.
    """

    def __init__(self, results: Path) -> None:
        home = os.environ.get("XDG_CACHE_HOME") or str(Path("~/.cache").expanduser())
        self._root = results.absolute()
        name = hashlib.sha256(str(self._root).encode()).hexdigest()[:20]
        self._file = Path(home) / "bns" / f"verified-{name}.json"
        self._known = _read(self._file)
        self._new_bytes = 0

    def has(self, path: Path, now: Identity) -> bool:
        """Whether this very file was found intact before."""
        return self._known.get(self._name(path)) == list(now)

    def add(self, path: Path, now: Identity) -> None:
        """It was found intact."""
        self._known[self._name(path)] = list(now)
        self._new_bytes += now[0]

    def save(self) -> None:
        """Keep it for other processes if that saves them any time to speak of."""
        if self._new_bytes < _REMEMBER_FROM:
            return
        self._new_bytes = 0
        staged = self._file.with_name(f"{self._file.name}.{os.getpid()}")
        there = {name: one for name, one in self._known.items() if (self._root / name).exists()}
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            staged.write_text(json.dumps(there), encoding="utf-8")
            staged.replace(self._file)
        except OSError:
            return  # a full or read-only home: the next process verifies again

    def _name(self, path: Path) -> str:
        return os.path.relpath(path.absolute(), self._root)


def _read(file: Path) -> dict[str, list[int]]:
    try:
        known = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}


def _stated(path: Path) -> tuple[int, bytes]:
    """Where in the file its digest stands (-1: nowhere), and the digest."""
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        start = max(0, size - _FOOTER_MOST)
        file.seek(start)
        tail = file.read()
    at = tail.rfind(_MARK)
    if at < 0:
        return -1, b""
    at += len(_MARK)
    return start + at, tail[at : at + _LENGTH]


def _blanked(chunk: bytes, at: int) -> bytes:
    """``chunk`` with what it holds of the digest, which begins at ``at`` in it, as it was when the digest was made."""
    begin, end = max(0, at), min(len(chunk), at + _LENGTH)
    return chunk if begin >= end else chunk[:begin] + b"0" * (end - begin) + chunk[end:]


def _place_of(data: bytes) -> int:
    at = data.rfind(_MARK)
    if at < 0:
        raise ValueError("the file has no place for a digest")
    return at + len(_MARK)
