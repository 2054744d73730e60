"""Results on disk: the only code that touches result files."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bns.store.disk.files import StoreWarning
    from bns.store.read.reader import connect, finished, load, query
    from bns.store.record import RunRecord
    from bns.store.schema import SCHEMA_VERSION, SCHEMAS
    from bns.store.write.compaction import CompactSummary, bytes_per_run, compact
    from bns.store.write.writer import Writer, spec_hash

_HOMES = {
    "write.compaction": ("CompactSummary", "bytes_per_run", "compact"),
    "disk.files": ("StoreWarning",),
    "read.reader": ("connect", "finished", "load", "query"),
    "record": ("RunRecord",),
    "schema": ("SCHEMAS", "SCHEMA_VERSION"),
    "write.writer": ("Writer", "spec_hash"),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [  # noqa: RUF022  # as in _HOMES
    "CompactSummary",
    "bytes_per_run",
    "compact",
    "StoreWarning",
    "connect",
    "finished",
    "load",
    "query",
    "RunRecord",
    "SCHEMAS",
    "SCHEMA_VERSION",
    "Writer",
    "spec_hash",
]


def __getattr__(name: str) -> Any:
    """Imported when it is asked for: a worker hands over records, and must not wait for the readers' libraries."""
    if name not in _HOME:
        raise AttributeError(f"module 'bns.store' has no attribute {name!r}")
    return getattr(import_module(f"bns.store.{_HOME[name]}"), name)
