"""Finished runs that are not in parquet files yet: an append-only file of checked frames.

A frame is ``MAGIC``, length of the payload (u64), CRC-32 of the payload, CRC-32 of the three before (u32,
all little-endian) and the payload: length of a JSON index (u32), the index, and one Arrow stream a table in
the index's order.
"""

from __future__ import annotations

import json
import os
import re
import struct
import time
import uuid
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa

from bns.errors import StoreError
from bns.store.disk.files import JOURNAL, explained, gone, is_same, make_folder, write_all
from bns.store.record import STATUSES
from bns.store.schema import SCHEMA_VERSION, upgraded

MAGIC = b"\x89BNSrun\n"
_HEAD = struct.Struct("<8sQI")
_CHECK = struct.Struct("<I")
_HEAD_SIZE = _HEAD.size + _CHECK.size
_YOUNG_S = 10
"""Age at which an empty journal is no longer one that is just being written; a first frame is written within a second."""
_FILE_NAME = re.compile(r"(?P<sweep>[A-Za-z][A-Za-z0-9_-]*)--(?P<id>j[0-9a-f]{32})\.journal")


@dataclass(frozen=True)
class Frame:
    """One run: where it belongs and its tables (file columns, this schema version)."""

    run_id: str
    task: str
    status: str
    spec_hash: str
    tables: dict[str, pa.Table]


@dataclass(frozen=True)
class JournalFile:
    """A journal on disk; ``id`` begins with a letter and names the parts that it is folded into."""

    path: Path
    sweep: str
    id: str

    @classmethod
    def new(cls, results: Path, sweep: str) -> JournalFile:
        """A name that nothing else has, whatever the clock says."""
        name = "j" + uuid.uuid4().hex
        return cls(results / JOURNAL / f"{sweep}--{name}.journal", sweep, name)


@dataclass(frozen=True)
class Scan:
    """What a journal holds: its good frames in order, bytes of damage, bytes of an unfinished last frame."""

    data: bytes
    frames: list[Frame]
    damaged: int
    torn: int


def journals(results: Path, sweep: str | None = None) -> list[JournalFile]:
    """The journals in ``results`` (of one sweep), by name."""
    folder = results / JOURNAL
    names = sorted(folder.glob("*.journal")) if folder.is_dir() else []
    found = [(path, _FILE_NAME.fullmatch(path.name)) for path in names]
    files = [JournalFile(path, match["sweep"], match["id"]) for path, match in found if match]
    return [file for file in files if sweep in (None, file.sweep)]


def read_journal(file: JournalFile) -> Scan:
    """Every whole frame of a journal, also of one that is being written; empty if it was folded meanwhile.

    Raises:
        StoreError: the file cannot be read, or a frame was written by a newer bns.
    """
    try:
        with explained("read", file.path):
            data = file.path.read_bytes()
    except StoreError as error:
        if isinstance(error.__cause__, FileNotFoundError):
            return Scan(b"", [], 0, 0)
        raise
    return scan(data, file)


def fault_of(file: JournalFile, found: Scan) -> str | None:
    """What is wrong with a journal, in words; None if nothing is.

    A writer makes a journal when its first run is over, so that one without a byte was emptied, or its first run never
    reached the disk. A young one is left alone: its writer may be between the two.
    """
    if found.damaged:
        return f"{file.path} is damaged ({found.damaged} bytes)"
    if not found.data and _age_s(file.path) > _YOUNG_S:
        return f"{file.path} is empty: its first run did not reach the disk, or the file was emptied"
    return None


def scan(data: bytes, file: JournalFile) -> Scan:
    """The frames in ``data``; after damage it goes on at the next frame whose checksums are right.

    A frame of another sweep counts as damage: the file was exchanged for another.
    """
    frames, at, damaged = [], 0, 0
    while at < len(data):
        payload = _payload_at(data, at)
        if payload is not None:
            size = _HEAD_SIZE + len(payload)
            frame = _decoded(payload, file)
            if frame is None:
                damaged += size
            else:
                frames.append(frame)
            at += size
            continue
        following = _next_frame(data, at + 1)
        if following is None:
            rest = len(data) - at
            torn = rest if _is_torn(data, at) else 0
            return Scan(data, frames, damaged + rest - torn, torn)
        damaged += following - at
        at = following
    return Scan(data, frames, damaged, 0)


def best_frames(frames: list[Frame]) -> list[Frame]:
    """Each run once: the first of its frames with its best status."""
    best: dict[str, Frame] = {}
    for frame in frames:
        known = best.get(frame.run_id)
        if known is None or STATUSES.index(frame.status) < STATUSES.index(known.status):
            best[frame.run_id] = frame
    return list(best.values())


class Journal:
    """A journal open for appending. Every append is on the disk when it returns, or leaves no trace."""

    def __init__(self, file: JournalFile) -> None:
        self.file = file
        self.runs = 0
        self.run_ids: set[str] = set()
        self._end = 0
        make_folder(file.path.parent)
        with explained("create", file.path):
            self._descriptor = os.open(file.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o666)
            folder = os.open(file.path.parent, os.O_RDONLY)
            os.fsync(folder)
            os.close(folder)
            self._made = os.fstat(self._descriptor)

    def append(self, frame: Frame) -> None:
        """Write one frame and sync it; StoreError if that fails or the file is gone, and the journal is as before."""
        data = encoded(frame, self.file.sweep)
        if not is_same(self.file.path, self._made):
            # Writes to a deleted file go well, and to nowhere.
            raise gone(self.file.path, f"It held {self.runs} finished runs; run {frame.run_id} is not stored.")
        with explained("write", self.file.path):
            try:
                self._cut()
                write_all(self._descriptor, data)
                os.fsync(self._descriptor)
            except OSError:
                self._cut()
                raise
        self._end += len(data)
        self.runs += 1
        self.run_ids.add(frame.run_id)

    def close(self) -> None:
        """Close the file; it stays until its runs are folded."""
        os.close(self._descriptor)

    def _cut(self) -> None:
        if os.fstat(self._descriptor).st_size != self._end:
            os.ftruncate(self._descriptor, self._end)


def encoded(frame: Frame, sweep: str) -> bytes:
    """The bytes of one frame of ``sweep``."""
    streams = {name: _stream(table) for name, table in frame.tables.items()}
    index = json.dumps(
        {
            "schema_version": SCHEMA_VERSION,
            "run_id": frame.run_id,
            "sweep": sweep,
            "task": frame.task,
            "status": frame.status,
            "spec_hash": frame.spec_hash,
            "tables": {name: len(stream) for name, stream in streams.items()},
        }
    ).encode()
    payload = b"".join([_CHECK.pack(len(index)), index, *streams.values()])
    head = _HEAD.pack(MAGIC, len(payload), zlib.crc32(payload))
    return head + _CHECK.pack(zlib.crc32(head)) + payload


def _stream(table: pa.Table) -> bytes:
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue())


def _age_s(path: Path) -> float:
    try:
        return time.time() - path.stat().st_mtime
    except OSError:
        return 0.0


def _length_at(data: bytes, at: int) -> int | None:
    head = data[at : at + _HEAD.size]
    check = data[at + _HEAD.size : at + _HEAD_SIZE]
    if len(check) < _CHECK.size or not head.startswith(MAGIC) or _CHECK.unpack(check)[0] != zlib.crc32(head):
        return None
    return int(_HEAD.unpack(head)[1])


def _payload_at(data: bytes, at: int) -> bytes | None:
    length = _length_at(data, at)
    if length is None:
        return None
    payload = data[at + _HEAD_SIZE : at + _HEAD_SIZE + length]
    wanted = _HEAD.unpack(data[at : at + _HEAD.size])[2]
    return payload if len(payload) == length and zlib.crc32(payload) == wanted else None


def _next_frame(data: bytes, at: int) -> int | None:
    at = data.find(MAGIC, at)
    while at >= 0 and _payload_at(data, at) is None:
        at = data.find(MAGIC, at + 1)
    return at if at >= 0 else None


def _is_torn(data: bytes, at: int) -> bool:
    # An append that was cut off leaves a short frame, or (a file grown before it was filled) zeros.
    # Anything else was whole once, and must be kept for somebody to look at.
    rest, length = data[at:], _length_at(data, at)
    if length is not None:
        return len(rest) < _HEAD_SIZE + length
    return (len(rest) < _HEAD_SIZE and MAGIC[: len(rest)] == rest[: len(MAGIC)]) or not any(rest)


def _decoded(payload: bytes, file: JournalFile) -> Frame | None:
    """The frame in ``payload``; None if it belongs to another sweep (frames of older versions do not say)."""
    start = _CHECK.size + _CHECK.unpack(payload[: _CHECK.size])[0]
    index: dict[str, Any] = json.loads(payload[_CHECK.size : start])
    version = index["schema_version"]
    if index.get("sweep", file.sweep) != file.sweep:
        return None
    if version > SCHEMA_VERSION:
        raise StoreError(
            f"{file.path} was written with schema version {version}; this bns knows "
            f"{SCHEMA_VERSION}. Update it: pip install -U bns"
        )
    tables = {}
    for name, length in index["tables"].items():
        table = pa.ipc.open_stream(pa.py_buffer(payload[start : start + length])).read_all()
        tables[name] = table if version == SCHEMA_VERSION else upgraded(name, table, version)
        start += length
    return Frame(index["run_id"], index["task"], index["status"], index["spec_hash"], tables)
