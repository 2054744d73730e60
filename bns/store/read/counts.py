"""Which runs have lost rows, by counting them: the only thing that tells where a file has no digest.

A row of ``runs`` says how many evaluations the run had: as many as its spec asks for, or fewer where it ended early. What a
run recorded beside them follows from its rows in ``evals``, whatever world or robot it was:

- paths: of each evaluation two, each numbered from 0; that of the driven has a row for the start and one for each command;
- probes: as many in each evaluation;
- generations: those of an evaluation once any have been bred. All of one evaluation are as many as the spec says.

Not seen are the last steps of a path of the fittest, which may have been driven in part, and a probe gone from all evaluations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import duckdb

from bns.store.disk.parts import Part
from bns.store.read.scan import placed
from bns.store.schema import RECORDED

Tables = Mapping[str, list[Part]]

_PATHS_OF, _ALL_OF = "regexp_matches(spec, '\"record\":\"(paths|full)\"')", "contains(spec, '\"record\":\"full\"')"
_FOUND = {
    "evals": "SELECT place, run_id, count(*) AS n, sum(commands) AS driven, count(*) FILTER (generations > 0) AS bred"
    " FROM {} GROUP BY ALL",
    "paths": "SELECT place, run_id, sum(n) AS n, sum(steps) AS steps, count(*) AS paths,"
    " coalesce(sum(steps - 1) FILTER (who = 'evaluated'), 0) AS driven FROM"
    " (SELECT place, run_id, evaluation, who, count(*) AS n, max(step) + 1 AS steps FROM {} GROUP BY ALL) GROUP BY ALL",
    "probes": "SELECT place, run_id, count(*) AS n, max(probe) + 1 AS probes FROM {} GROUP BY ALL",
    "generations": "SELECT place, run_id, count(*) AS n FROM {} GROUP BY ALL",
}
_WHOLE = {
    "evals": "evals.n = evaluations",
    "paths": f"NOT {_PATHS_OF} OR paths.n = steps AND paths = 2 * evaluations AND paths.driven = evals.driven",
    "probes": f"NOT {_ALL_OF} OR probes.n = probes * evaluations",
    "generations": f"NOT {_ALL_OF} OR coalesce(generations.n, 0) = bred * generations_per_evaluation",
}
"""SQL: whether all rows of a run that is ok are there; NULL, as where it has none, is no."""


@dataclass(frozen=True)
class Miscounts:
    """By place: ``short``, the runs that are ok and have lost rows; ``strays``, those with rows and no row in ``runs``."""

    short: Mapping[str, frozenset[str]]
    strays: Mapping[str, frozenset[str]]

    @property
    def places(self) -> set[str]:
        """Where something is not as it should be."""
        return {*self.short, *self.strays}


def suspects(tables: Tables, evaluations: Mapping[str, int]) -> set[str]:
    """The places whose rows must be counted run by run.

    Those that hold more or fewer rows of ``evals`` than the ``evaluations`` of their runs that are ok, which costs nothing to
    know, and those from before digests that hold anything else. Places whose ``evals`` are gone are known already.
    """
    rows = {part.place: part.rows for part in tables["evals"]}
    odd = {place for place, wanted in evaluations.items() if rows.get(place, wanted) != wanted}
    older = {part.place for part in tables["runs"] if part.vouched is None and part.place in rows}
    return odd | {part.place for name in RECORDED[1:] for part in tables[name] if part.place in older}


def miscounts(connection: duckdb.DuckDBPyConnection, results: Path, tables: Tables, places: set[str]) -> Miscounts:
    """What is wrong with the counts of these `suspects`."""
    if not places:
        return Miscounts({}, {})
    chosen = {name: [part for part in tables[name] if part.place in places] for name in ("runs", *RECORDED)}
    runs = placed(results / "runs", chosen["runs"])
    older = [part.place for part in chosen["runs"] if part.vouched is None]
    found = {name: _FOUND[name].format(placed(results / name, chosen[name])) for name in RECORDED if chosen[name]}
    short: list[tuple[str, str]] = []
    for name, rows_of in found.items():
        asked = [part.place for part in chosen[name] if name == "evals" or part.place in older]
        beside = "" if name == "evals" else f"LEFT JOIN ({rows_of}) AS {name} USING (place, run_id)"
        short += connection.execute(
            f"""WITH evals AS ({found["evals"]})
            SELECT place, run_id FROM {runs} AS runs LEFT JOIN evals USING (place, run_id) {beside}
            WHERE status = 'ok' AND place IN (SELECT unnest(?::VARCHAR[])) AND NOT coalesce({_WHOLE[name]}, false)""",
            [asked],
        ).fetchall()
    rows = " UNION ".join(f"SELECT place, run_id FROM ({one})" for one in found.values())
    strays = connection.execute(f"SELECT * FROM ({rows}) ANTI JOIN {runs} AS runs USING (place, run_id)").fetchall()
    return Miscounts(_by_place(short), _by_place(strays))


def _by_place(pairs: list[tuple[str, str]]) -> dict[str, frozenset[str]]:
    runs: dict[str, set[str]] = {}
    for place, run in pairs:
        runs.setdefault(place, set()).add(run)
    return {place: frozenset(those) for place, those in runs.items()}
