"""What an archive keeps of every run, and how the rows of ``evals`` are rounded to it.

Successes are kept exactly, as bits. Measures are rounded to decimals. Whoever reads the results through `rounded` sees the same
numbers from the results and from an archive of them.
"""

from __future__ import annotations

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
RUN_COLUMNS = (
    *("run_id", "sweep", "robot", "task", *PARAMETERS, "status", "error", "evaluations", "spec", "world_digest"),
    *("git_sha", "git_clean", "bns_version", "versions"),
)
"""Columns of runs that are kept as they are."""
SUCCESSES = tuple(prefix + name for prefix in WHOSE.values() for name in ("success", *NEAR))
EVAL_COLUMNS = ("run_id", "sweep", "robot", "task", *PARAMETERS, "evaluation", *SUCCESSES, *DECIMALS)
"""Columns of evals that every archive gives back."""
_DECIMALS = DECIMALS | COMPARED


def whole(measure: str) -> str:
    """SQL: a measure of evals as the whole number that the file holds."""
    return f"CASE WHEN isfinite({measure}) THEN TRY_CAST(round({measure} * {10 ** _DECIMALS[measure]}) AS INTEGER) END"


def rounded(measure: str) -> str:
    """SQL: a measure of evals as an archive gives it back."""
    return f"{whole(measure)} / {10 ** _DECIMALS[measure]}.0"


def rounded_evals(table: str) -> str:
    """SELECT of all columns of a table of evals, its measures rounded to what an archive keeps."""
    return f"SELECT * REPLACE ({', '.join(f'{rounded(name)} AS {name}' for name in _DECIMALS)}) FROM {table}"


def bits(prefix: str) -> str:
    """SQL: the successes of one row of evals as bits; what is unknown is 0."""
    places = enumerate((f"{prefix}success", *(prefix + name for name in NEAR)))
    return " + ".join(f"coalesce({name}, false)::UTINYINT * {1 << place}" for place, name in places)
