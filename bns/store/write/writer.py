"""The only way into the results: one writer a sweep, every run on the disk before it counts."""

from __future__ import annotations

import hashlib
import io
import json
import uuid
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType

import pyarrow as pa
import pyarrow.json as pa_json

from bns.errors import StoreError
from bns.store.disk.files import checked_name, gone, publish
from bns.store.disk.journal import Frame, Journal, JournalFile, journals
from bns.store.disk.lock import ShardLock, SweepLock
from bns.store.disk.parquet import file_bytes
from bns.store.disk.parts import find_parts
from bns.store.provenance import provenance
from bns.store.record import RunRecord, record_tables
from bns.store.schema import SCHEMAS, file_metadata
from bns.store.write.fold import clear_staging, fold_journal, staged
from bns.store.write.repair import set_aside_damaged


def spec_hash(text: str) -> str:
    """Name of a sweep file by its text: ``s`` and 20 hexadecimal digits, "" without a text."""
    return "s" + hashlib.sha256(text.encode()).hexdigest()[:20] if text else ""


class Writer:
    """Writes the runs of one sweep; a context manager.

    Args:
        results: the folder of all results; made on entering.
        sweep: name of the sweep: letters, digits, - and _, a letter first.
        sweep_text: the sweep file as YAML, kept in the specs table.
        sweep_runs: how many runs that file describes, if known.
        fold_at: runs in the journal at which they are folded into parquet files.
        shard: name of the share that this writer has of the sweep; writers of other shares may be at work.

    Entering takes the sweep's lock, folds what a killed writer left (``recovered`` counts those runs) and sets aside
    what is damaged. The writer of a shard takes the shard's lock and leaves alone whatever it did not make: a journal that looks
    abandoned may be that of another machine.
    """

    def __init__(
        self,
        results: Path,
        sweep: str,
        *,
        sweep_text: str = "",
        sweep_runs: int | None = None,
        fold_at: int = 128,
        shard: str = "",
    ) -> None:
        if fold_at < 1:
            raise StoreError(f"fold_at is {fold_at}; it must be 1 or more runs.")
        self.results = Path(results)
        self.sweep = checked_name("sweep", sweep)
        self.recovered = 0
        self._text, self._planned, self._fold_at = sweep_text, sweep_runs, fold_at
        self._lock = ShardLock(self.results, sweep, shard) if shard else SweepLock(self.results, sweep)
        self._is_alone = not shard
        self._journal: Journal | None = None
        self._unfolded: list[JournalFile] = []
        self._open = False

    def __enter__(self) -> Writer:
        self._lock.acquire()
        try:
            if self._is_alone:
                clear_staging(self.results, self.sweep)
                self.recovered = self.fold()
                set_aside_damaged(self.results, self.sweep)
            self._publish_spec()
        except BaseException:
            self._lock.release()
            raise
        self._open = True
        return self

    def append(self, record: RunRecord) -> None:
        """Store one finished run; it survives a crash from the moment this returns.

        Raises:
            StoreError: the record does not fit the schema, or the disk does not take it (it is not stored
                then: as when the results were deleted or moved), or the fold that fell due failed (it is stored then:
                the journal keeps it).
        """
        if not self._open:
            raise StoreError(f"the writer of sweep {self.sweep!r} is not open; use it in a with statement.")
        task = checked_name("task", record.spec.task)
        tables = record_tables(record, provenance())
        if self._journal is None:
            self._lock.check()
            self._journal = Journal(JournalFile.new(self.results, self.sweep))
        self._journal.append(Frame(record.spec.run_id, task, record.run["status"], spec_hash(self._text), tables))
        if self._journal.runs >= self._fold_at:
            self.fold()

    def fold(self) -> int:
        """Publish the runs in this sweep's (this shard's own) journals as parquet parts; the number of runs.

        Raises:
            StoreError: the disk fails, or what was appended is not there any more.
        """
        own, self._journal = self._journal, None
        if own is not None:
            own.close()
            self._unfolded.append(own.file)
        # All of them: an earlier fold may have failed on a full disk.
        files = journals(self.results, self.sweep) if self._is_alone else self._unfolded
        folded = {file.id: fold_journal(self.results, file) for file in files}
        self._unfolded = []
        if own is not None and folded.get(own.file.id, 0) < len(own.run_ids):
            raise gone(
                own.file.path,
                f"{len(own.run_ids)} runs were written to it and {folded.get(own.file.id, 0)} found in it.",
            )
        self._lock.check()
        return sum(folded.values())

    def close(self) -> None:
        """Fold the rest and give the sweep free; without effect if it is not open."""
        if self._open:
            self._open = False
            try:
                self.fold()
            finally:
                self._lock.release()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
            return
        # After a fault nothing more is written: the journal keeps the runs, and the first fault is reported.
        self._open = False
        if self._journal is not None:
            self._journal.close()
            self._journal = None
        self._lock.release()

    def _publish_spec(self) -> None:
        name = spec_hash(self._text)
        place = self.results / "specs" / f"sweep={self.sweep}" / f"spec-{name}.parquet"
        # Beside others it is written again, with today's date: the latest file is the one that the sweep follows.
        there = [part.path for part in find_parts(self.results, "specs", self.sweep)[0]] if name else []
        if not name or there == [place]:
            return
        made = provenance()
        written_at = datetime.now(UTC).isoformat(timespec="microseconds").replace("+00:00", "Z")
        row = {"spec_hash": name, "written_at": written_at, "text": self._text, "runs": self._planned}
        metadata = file_metadata(
            "specs",
            self.sweep,
            spec_hash=name,
            git_sha=made.git_sha,
            git_clean=made.git_clean,
            bns_version=made.bns_version,
        )
        data = file_bytes("specs", _one_row(row, SCHEMAS["specs"]), metadata)
        # Shards that start together write the same file: each builds its own and puts it there.
        publish(data, staged(self.results, self.sweep, f"spec-{name}-{uuid.uuid4().hex}"), place)


def _one_row(row: Mapping[str, str | int | None], schema: pa.Schema) -> pa.Table:
    """From JSON: pyarrow loads pandas for values of Python, which keeps the first run waiting for a third of a second."""
    text = json.dumps(row).encode()
    return pa_json.read_json(
        io.BytesIO(text),
        read_options=pa_json.ReadOptions(block_size=len(text) + 1),
        parse_options=pa_json.ParseOptions(explicit_schema=schema),
    )
