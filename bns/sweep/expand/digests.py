"""Results of one sweep must come from one world: the same networks, models and tables behind every run."""

from __future__ import annotations

from pathlib import Path

from bns.errors import StoreError
from bns.spec import RunSpec
from bns.store.archive.read import archived
from bns.store.read.reader import load_rows
from bns.store.record import RunRecord


class WorldDigests:
    """The world digest of every (task, world) of a sweep, as the store has it."""

    def __init__(self, results: Path, sweep: str) -> None:
        self._results, self._sweep = results, sweep
        self._known: dict[tuple[str, str], str] = {}

    def read(self) -> None:
        """Take note of the runs in the store, which must exist, and in its archives."""
        kept = [row[2:] for row in archived(self._results, self._sweep) if row[1] == "ok"]
        columns = ["task", "world", "world_digest"]
        stored = load_rows(self._results, "runs", columns, {"sweep": self._sweep, "status": "ok"})
        for task, world, digest in dict.fromkeys([*kept, *stored]):
            self.compare(task, world, digest)

    def check(self, record: RunRecord) -> None:
        """StoreError if there are runs of this sweep, task and world with another digest."""
        spec: RunSpec = record.spec
        if record.run["status"] == "ok":
            self.compare(spec.task, spec.world, record.run.get("world_digest", ""))

    def compare(self, task: str, world: str, digest: str) -> None:
        """StoreError if the runs of this task and world that are known by now have another digest."""
        former = self._known.setdefault((task, world), digest) if digest else digest
        if former != digest:
            raise StoreError(
                f"the results of sweep {self._sweep!r} in {self._results} were made with world {former} "
                f"(task {task}, world {world}), but there is now one with world {digest}: a network or model "
                "file has changed. They must not be mixed: give another folder with --results, bring the "
                "former files back or, for a sweep file, change its name."
            )
