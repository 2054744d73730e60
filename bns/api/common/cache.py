"""What was asked before is not worked out again: results beside their keys in the user's cache folder.

A key is a digest of the data's values, the model, the settings, the question, the program's own source and the libraries that
compute: whatever changes one of them asks for another entry. An entry carries the digest of its bytes; one that does not match,
does not read or belongs to somebody else is no entry. ``BNS_CACHE`` in the environment names another folder; with ``off`` nothing
is kept and nothing is taken from before.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import pickle
import platform
import tempfile
from collections.abc import Callable, Iterable
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import bns
from bns.api.common.prepared import Prepared
from bns.diagnose.adding import model_yaml
from bns.diagnose.settings import DEFAULTS, Settings
from bns.physics.effects import all_effects
from bns.registry import EFFECTS

T = TypeVar("T")

MOST_BYTES = 256 << 20
"""All entries together; the ones that were not asked for longest go first."""
LARGEST_BYTES = MOST_BYTES // 4
"""A larger result is not kept."""
_LIBRARIES = ("numpy", "scipy", "numba", "pandas", "scikit-learn")
_MARK = b"bns 1\n"
_OFF = {"off", "0", "no"}


def folder() -> Path | None:
    """Where entries are; None where nothing is kept."""
    chosen = os.environ.get("BNS_CACHE", "")
    if chosen.lower() in _OFF:
        return None
    if chosen:
        return Path(chosen)
    home = os.environ.get("XDG_CACHE_HOME") or str(Path("~/.cache").expanduser())
    return Path(home) / "bns" / "diagnose"


def remembered(
    question: str,
    ready: Prepared,
    more: Iterable[Any],
    work: Callable[[], T],
    kind: type[T],
    fresh: bool = False,
    settings: Settings = DEFAULTS,
) -> T:
    """What ``work`` gives for these data and this model, or gave before.

    ``more``: what else the answer depends on, plain values. ``kind``: the answer's class. ``fresh`` works it out again.
    Effects in Python files and of packages, whose programs may have changed, are never taken from before.
    """
    place = folder()
    if place is None or not _may_be_kept(ready):
        return work()
    entry = place / f"{key(question, ready, more, settings)}.pickle"
    found = None if fresh else _read(entry, ready, kind)
    if found is not None:
        return found
    answer = work()
    _write(entry, answer, ready)
    return answer


def key(question: str, ready: Prepared, more: Iterable[Any], settings: Settings = DEFAULTS) -> str:
    """64 hexadecimal digits of all that the answer depends on."""
    made_of = {
        "question": question,
        "data": ready.log.sha256,
        "columns": [str(name) for name in ready.log.measured.table.columns],
        "model": [ready.model.name, ready.model.canonical_json(), model_yaml(ready.model)],
        "settings": settings.digest(),
        "more": list(more),
        "source": source_sha256(),
        "machine": [platform.machine(), platform.processor(), platform.python_version(), *map(version, _LIBRARIES)],
    }
    return hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()


@cache
def source_sha256() -> str:
    """Of all files of the package that an answer may depend on, by name."""
    whole, root = hashlib.sha256(), Path(bns.__file__).parent
    for path in sorted(p for kind in ("*.py", "*.yaml") for p in root.rglob(kind)):
        whole.update(str(path.relative_to(root)).encode() + b"\0" + path.read_bytes())
    return whole.hexdigest()


def _may_be_kept(ready: Prepared) -> bool:
    own = any("file" in active.written for active in ready.model.effects)
    return not own and not any(EFFECTS.is_plugin(name) for name in all_effects())


def _read(entry: Path, ready: Prepared, kind: type[T]) -> T | None:
    """The entry's answer; None for whatever keeps it from being read."""
    try:
        if hasattr(os, "getuid") and entry.stat().st_uid != os.getuid():
            return None
        whole = entry.read_bytes()
        mark, digest, body = whole[: len(_MARK)], whole[len(_MARK) : len(_MARK) + 32], whole[len(_MARK) + 32 :]
        if mark != _MARK or hashlib.sha256(body).digest() != digest:
            return None
        answer = _Unpickler(io.BytesIO(body), ready.predictor).load()
        os.utime(entry)
    except Exception:  # an entry that cannot be read is none, whatever is wrong with it
        return None
    return answer if isinstance(answer, kind) else None


def _write(entry: Path, answer: object, ready: Prepared) -> None:
    """Let the entry appear whole, or not at all: a cache that cannot be written to is none."""
    with contextlib.suppress(Exception):  # an answer that cannot be pickled, a full or read-only disk
        buffer = io.BytesIO()
        _Pickler(buffer, ready.predictor).dump(answer)
        body = buffer.getvalue()
        if len(body) > LARGEST_BYTES:
            return
        entry.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        handle, name = tempfile.mkstemp(dir=entry.parent, suffix=".part")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(_MARK + hashlib.sha256(body).digest() + body)
            Path(name).replace(entry)
        finally:
            Path(name).unlink(missing_ok=True)
        _bounded(entry.parent)


def _bounded(place: Path) -> None:
    """Remove what was not asked for longest, and what a killed process left."""
    entries = [(path.stat().st_mtime, path.stat().st_size, path) for path in place.glob("*.p*")]
    total = sum(size for _, size, _ in entries)
    for _, size, path in sorted(entries):
        if total <= MOST_BYTES:
            return
        path.unlink(missing_ok=True)
        total -= size


class _Pickler(pickle.Pickler):
    """The predictor, which is made from the data at hand, stays out of the entry."""

    def __init__(self, file: io.BytesIO, predictor: object) -> None:
        super().__init__(file, protocol=pickle.HIGHEST_PROTOCOL)
        self._predictor = predictor

    def persistent_id(self, obj: object) -> str | None:
        """A name in the place of the predictor."""
        return "predictor" if obj is self._predictor else None


class _Unpickler(pickle.Unpickler):
    """The predictor at hand takes the place that it had."""

    def __init__(self, file: io.BytesIO, predictor: object) -> None:
        super().__init__(file)
        self._predictor = predictor

    def persistent_load(self, pid: object) -> object:
        """The predictor."""
        if pid != "predictor":
            raise pickle.UnpicklingError(f"unknown name {pid!r}")
        return self._predictor
