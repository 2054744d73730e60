"""Jobs that take the place of real runs. At module level, so that worker processes can import them."""

import os
import signal
import time
import warnings
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from bns.spec import RunSpec
from bns.store.record import RunRecord
from bns.store.schema import PARAMETERS, SCHEMAS
from bns.sweep.expand.grid import Sweep

MARKS = "BNS_TEST_MARKS"
"""Environment variable: the folder that jobs leave marks in."""


def make_sweep(name: str = "demo", combos: int = 4, seeds: int = 2, evaluations: int = 3, text: str = "") -> Sweep:
    each = tuple({"population_size": 10 + n, "evaluations": evaluations} for n in range(combos))
    return Sweep(name, "khepera", seeds, each, text, Path("x.yaml"))


def evals_of(spec: RunSpec) -> dict[str, np.ndarray]:
    """Columns that depend on nothing but the spec."""
    draws = np.random.default_rng(int(spec.run_id[1:9], 16))
    own = [f for f in SCHEMAS["evals"] if f.name not in {"run_id", "robot", *PARAMETERS}]
    columns = {f.name: draws.integers(0, 100, spec.evaluations).astype(f.type.to_pandas_dtype()) for f in own}
    return columns | {"evaluation": np.arange(1, spec.evaluations + 1, dtype=np.int32)}


def ok(spec: RunSpec, wall_s: float = 0.01, digest: str = "w1") -> RunRecord:
    run = {
        "status": "ok",
        "error": None,
        "world_digest": digest,
        "started_at": datetime.now(UTC),
        "wall_s": wall_s,
        "cpu_s": wall_s,
        "peak_memory_mib": 1.0,
        "attempts": 1,
    }
    return RunRecord(spec, run, {"evals": evals_of(spec)})


def other_world(spec: RunSpec) -> RunRecord:
    return ok(spec, digest="w2")


def short(spec: RunSpec) -> RunRecord:
    time.sleep(0.05)
    return ok(spec, 0.05)


def half_second(spec: RunSpec) -> RunRecord:
    time.sleep(0.5)
    return ok(spec, 0.5)


def slow(spec: RunSpec) -> RunRecord:
    mark(f"begun-{spec.run_id}-{os.getpid()}")
    time.sleep(0.6)
    return ok(spec, 0.6)


def endless(spec: RunSpec) -> RunRecord:
    mark(f"begun-{spec.run_id}-{os.getpid()}")
    time.sleep(300)
    return ok(spec)


def warning(spec: RunSpec) -> RunRecord:
    """One warning of all runs, twice; one of population 10; one a run."""
    for _ in range(2):
        warnings.warn("the floor is not level", stacklevel=1)
    if spec.population_size == 10:
        warnings.warn("a small population", RuntimeWarning, stacklevel=1)
    warnings.warn(f"seed {spec.seed} of {spec.population_size}", stacklevel=1)
    return ok(spec)


def warning_and_faulty(spec: RunSpec) -> RunRecord:
    warnings.warn("about to fail", stacklevel=1)
    raise ValueError("no")


def warning_and_killed(spec: RunSpec) -> RunRecord:
    warnings.warn("about to die", stacklevel=1)
    os.kill(os.getpid(), signal.SIGKILL)
    return ok(spec)


def faulty(spec: RunSpec) -> RunRecord:
    raise SystemExit(3)


def killed(spec: RunSpec) -> RunRecord:
    """Population 10 kills its worker, the others say which process they ran in."""
    mark(f"{spec.population_size}-{spec.seed}-{os.getpid()}-{time.monotonic_ns()}")
    if spec.population_size == 10:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.05)
    return ok(spec)


def killed_once(spec: RunSpec) -> RunRecord:
    if spec.population_size == 10 and not list(marks().glob("died")):
        mark("died")
        os.kill(os.getpid(), signal.SIGSEGV)
    return ok(spec)


def environment(spec: RunSpec) -> RunRecord:
    record = ok(spec)
    note = f"{os.environ['OMP_NUM_THREADS']} {signal.getsignal(signal.SIGINT)!r} {os.getpid()}"
    return RunRecord(spec, {**record.run, "world_digest": note}, record.tables)


def left_alone(spec: RunSpec) -> RunRecord:
    """Which signals the process ignores."""
    names = [one.name for one in signal.Signals if signal.getsignal(one) is signal.SIG_IGN]
    record = ok(spec)
    return RunRecord(spec, {**record.run, "world_digest": " ".join(names)}, record.tables)


def marks() -> Path:
    return Path(os.environ[MARKS])


def mark(name: str) -> None:
    (marks() / name).touch()
