"""What an archive keeps of every run, and how the rows of ``evals`` are rounded to it.

Successes are kept exactly, as bits. Measures are rounded to decimals. Whoever reads the results through `rounded` sees the same
numbers from the results and from an archive of them.
"""

from __future__ import annotations

from collections.abc import Iterable

from bns.store.schema import NEAR_CM, PARAMETERS

FORMAT = 1
"""Version of the archive's own columns."""
NEAR = tuple(f"success_{cm}cm" for cm in NEAR_CM)
WHOSE = {"success_bits": "", "ever_bits": "ever_", "evaluated_bits": "evaluated_"}
"""Column of the archive -> prefix of its columns in evals: bit 0 is ``success``, the next ones `NEAR`."""
DECIMALS = {"diversity": 3, "fitness_error": 3, "fitness_world": 3, "fittest_commands": 0}
"""Measure of evals -> decimals that it is kept with; a number that is not finite, or beyond 32 bits, is kept as none."""
COMPARED = {"robot_s": 1, "evaluated_fitness_error": 3}
"""Measure of evals -> decimals, kept as well of sweeps with several approaches: they are compared by the robot's time."""
COMPARED_RUN = ("cpu_s",)
"""Columns of runs that are kept as well of such sweeps."""
POSE = ("x_m", "y_m", "heading_rad")
RECORDED = {
    "generations": {"evaluation": 0, "generation": 0, "best_fitness": 4, "best_fitness_world": 4, "mean_fitness": 4},
    "probes": {"evaluation": 0, "probe": 0, "distance_m": 5, "change_m": 5},
    "paths": {"evaluation": 0, "who": 0, "step": 0, **dict.fromkeys((*POSE, *(f"snn_{name}" for name in POSE)), 4)},
}
"""Table that runs may have recorded (``record: full``) -> columns that are kept of it and the decimals of measures."""
RECORDED_ROWS = {"generations": "true", "probes": "true", "paths": "who = 'fittest'"}
"""SQL: which rows are kept; figures show the paths of the fittest, and those of the evaluated would double the file."""
RECORDED_ORDER = {"generations": "generation", "probes": "evaluation, probe", "paths": "evaluation, step"}
RECORDING = {"driven_ms": 0}
"""Measure of evals -> decimals, kept as well of sweeps with runs that recorded one of these tables."""
RECORDING_RUN = ("started_at",)
"""Columns of runs that are kept as well of such sweeps."""
RUN_COLUMNS = (
    *("run_id", "sweep", "robot", "task", *PARAMETERS, "status", "error", "evaluations", "spec", "world_digest"),
    *("git_sha", "git_clean", "bns_version", "versions"),
)
"""Columns of runs that are kept as they are."""
SUCCESSES = tuple(prefix + name for prefix in WHOSE.values() for name in ("success", *NEAR))
EVAL_COLUMNS = ("run_id", "sweep", "robot", "task", *PARAMETERS, "evaluation", *SUCCESSES, *DECIMALS)
"""Columns of evals that every archive gives back."""
_MEASURES = {name: decimals for columns in RECORDED.values() for name, decimals in columns.items() if decimals}
_DECIMALS = DECIMALS | COMPARED | RECORDING | _MEASURES


def recorded_column(table: str, name: str) -> str:
    """Column of the archive that holds, as a list a run, what ``table`` has under ``name``."""
    return f"{table}_{name}"


def whole(measure: str) -> str:
    """SQL: a measure as the whole number that the file holds."""
    return f"CASE WHEN isfinite({measure}) THEN TRY_CAST(round({measure} * {10 ** _DECIMALS[measure]}) AS INTEGER) END"


def rounded(measure: str) -> str:
    """SQL: a measure as an archive gives it back."""
    return f"{whole(measure)} / {10 ** _DECIMALS[measure]}.0"


def rounded_evals(rows: str) -> str:
    """SELECT of all columns of rows of evals, their measures rounded to what an archive keeps."""
    return _rounded(rows, DECIMALS | COMPARED | RECORDING)


def rounded_rows(rows: str, table: str) -> str:
    """The same of rows of ``table``, one of `RECORDED`."""
    return _rounded(rows, {name: decimals for name, decimals in RECORDED[table].items() if decimals})


def _rounded(rows: str, measures: Iterable[str]) -> str:
    return f"SELECT * REPLACE ({', '.join(f'{rounded(name)} AS {name}' for name in measures)}) FROM {rows}"


def bits(prefix: str) -> str:
    """SQL: the successes of one row of evals as bits; what is unknown is 0."""
    places = enumerate((f"{prefix}success", *(prefix + name for name in NEAR)))
    return " + ".join(f"coalesce({name}, false)::UTINYINT * {1 << place}" for place, name in places)
