"""Results on disk: the only code that touches result files."""

from bns.store.compact import CompactSummary, bytes_per_run, compact
from bns.store.files import StoreWarning
from bns.store.reader import connect, finished, load, query
from bns.store.record import RunRecord
from bns.store.schema import SCHEMA_VERSION, SCHEMAS
from bns.store.writer import Writer, spec_hash

__all__ = [
    "SCHEMAS",
    "SCHEMA_VERSION",
    "CompactSummary",
    "RunRecord",
    "StoreWarning",
    "Writer",
    "bytes_per_run",
    "compact",
    "connect",
    "finished",
    "load",
    "query",
    "spec_hash",
]
