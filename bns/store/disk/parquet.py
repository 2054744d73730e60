"""Bytes of one parquet part, and back."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from bns.store.disk.digest import BLANK, FIELD, sealed
from bns.store.schema import METADATA_KEY, PARAMETERS, SCHEMA_VERSION, SCHEMAS, SORT_KEYS, file_metadata

READ_FAULTS = (pa.ArrowException, ValueError, KeyError, OSError, MemoryError)
"""What pyarrow raises at a file that is damaged or no parquet file (a name that is no UTF-8 is a ValueError)."""


def part_bytes(
    name: str,
    table: pa.Table,
    sweep: str,
    spec_hashes: Iterable[str],
    runs: pa.Table,
    *,
    task: str,
    parts: Mapping[str, str] | None = None,
) -> bytes:
    """``table`` (file columns of table ``name``, any order of rows) sorted, as a parquet file.

    ``runs`` are the rows of the runs table that it belongs to: their commits and versions are its metadata. ``parts``
    are the digests of the fold's other tables, which the part of table "runs" vouches for.
    """
    clean = set(runs["git_clean"].to_pylist())
    metadata = file_metadata(
        name,
        sweep,
        spec_hash=_joined(spec_hashes),
        git_sha=_joined(runs["git_sha"].to_pylist()),
        git_clean=None if None in clean or not clean else all(clean),
        bns_version=_joined(runs["bns_version"].to_pylist()),
        task=task,
        parts=parts,
    )
    ordered = table.sort_by([(key, "ascending") for key in SORT_KEYS[name]])
    return file_bytes(name, ordered, metadata)


def file_bytes(name: str, table: pa.Table, metadata: bytes) -> bytes:
    """``table`` as a parquet file of this schema version with the given JSON and a digest under the key "bns"."""
    metadata = json.dumps({**json.loads(metadata), FIELD: BLANK}).encode()
    measures = _measures(name)
    sink = pa.BufferOutputStream()
    pq.write_table(
        table.replace_schema_metadata({METADATA_KEY: metadata}),
        sink,
        compression="zstd",
        use_dictionary=[column for column in SCHEMAS[name].names if column not in measures],
        column_encoding=dict.fromkeys(measures, "BYTE_STREAM_SPLIT"),
        write_page_checksum=True,
    )
    return sealed(bytes(sink.getvalue()))


def read_part(path: Path, columns: list[str] | None = None) -> pa.Table:
    """All rows of a part (of some columns), page checksums verified; ``READ_FAULTS`` if it is damaged."""
    with pq.ParquetFile(path, page_checksum_verification=True) as file:
        return file.read(columns=columns)


def joined_hashes(metadata: Iterable[bytes]) -> set[str]:
    """The spec hashes that the metadata of several parts name."""
    return {one for text in metadata for one in json.loads(text).get("spec_hash", "").split(",")}


def renewed_metadata(metadata: bytes) -> bytes:
    """The metadata of an older file with the schema version of this bns."""
    return json.dumps({"task": "", **json.loads(metadata), "schema_version": SCHEMA_VERSION}).encode()


def _joined(texts: Iterable[str]) -> str:
    return ",".join(sorted({text for text in texts if text}))


@cache
def _measures(name: str) -> tuple[str, ...]:
    # Measured numbers hardly repeat: split by bytes they are a quarter smaller, and quicker to write.
    return tuple(
        field.name for field in SCHEMAS[name] if pa.types.is_float64(field.type) and field.name not in PARAMETERS
    )
