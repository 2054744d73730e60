"""Ask the product through its command line, in workers of their own; what this code has answered is not asked again."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import bns
from tests.hidden_effects.acceptable import acceptable
from tests.hidden_effects.world import World, write

Record = dict[str, Any]
ASKED = ("diagnose", "physics", "engine")
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
"""For libraries that would start threads of their own in every worker."""


def shares(jobs: int) -> dict[str, str]:
    """Set before workers are started: worlds are asked side by side, each on its share of the cores."""
    return {**ONE_THREAD, "LOKY_MAX_CPU_COUNT": str(max((os.cpu_count() or 1) // jobs, 1))}


def answers(
    worlds: Sequence[World], folder: Path, jobs: int, fresh: bool, options: Sequence[str] = ()
) -> Iterator[tuple[World, Record]]:
    """(world, record) as they come; records of worlds that have not changed are read from `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    left = []
    for world in worlds:
        kept = None if fresh else _kept(world, folder)
        if kept is None:
            left.append(world)
        else:
            yield world, kept
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        asked = {pool.submit(ask, world, list(options)): world for world in left}
        try:
            for done in as_completed(asked):
                world, record = asked[done], done.result()
                _keep(world, folder, record)
                yield world, record
        finally:
            pool.shutdown(cancel_futures=True)


def ask(world: World, options: Sequence[str] = ()) -> Record:
    """One world: {answer, seconds_s, cpu_s, exit, error}. `answer` is None where there is no JSON object to be read."""
    with tempfile.TemporaryDirectory() as folder:
        data = write(world, Path(folder), acceptable(world))
        began, worked = time.perf_counter(), time.process_time()
        status, out, fault = called(["diagnose", str(data), *world.nominal.arguments, "--json", *world.options, *options])
        seconds, cpu = time.perf_counter() - began, time.process_time() - worked
    try:
        given = json.loads(out)
    except ValueError:
        given, fault = None, fault or f"no JSON on stdout: {out[-300:]!r}"
    return {"answer": given, "seconds_s": seconds, "cpu_s": cpu, "exit": status, "error": fault}


def called(arguments: list[str]) -> tuple[int, str, str]:
    """(exit code, stdout, what went wrong) of the command line, in this process."""
    from bns.cli.main import main

    out, told = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(told):
        try:
            status = main(arguments)
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 1
        except Exception:  # a traceback is an answer, and a wrong one
            return 1, out.getvalue(), traceback.format_exc()
    return int(status or 0), out.getvalue(), told.getvalue()[-2000:] if status else ""


def _digest(world: World) -> str:
    """Of the world, and of the code that is asked about it: an answer of other code is no answer."""
    truth = json.dumps(world.truth(), sort_keys=True, default=str)
    return hashlib.sha256((truth + code_asked()).encode()).hexdigest()[:16]


@cache
def code_asked() -> str:
    """Digest of the files that an answer depends on."""
    files = [path for room in ASKED for path in sorted((Path(bns.__file__).parent / room).rglob("*.py"))]
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()


def _path(world: World, folder: Path) -> Path:
    return folder / f"{world.name}-seed-{world.seed}.json"


def _kept(world: World, folder: Path) -> Record | None:
    path = _path(world, folder)
    if not path.is_file():
        return None
    record: Record = json.loads(path.read_text())
    return record if record["world"] == _digest(world) else None


def _keep(world: World, folder: Path, record: Record) -> None:
    record["world"] = _digest(world)
    path = _path(world, folder)
    draft = path.with_suffix(".part")
    draft.write_text(json.dumps(record | {"truth": world.truth()}, indent=1) + "\n")
    draft.replace(path)
