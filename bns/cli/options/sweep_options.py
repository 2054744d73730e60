"""Options of the command line that say where a sweep is carried out."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from bns.errors import SpecError

if TYPE_CHECKING:
    from bns.sweep.expand.shard import Shard
    from bns.sweep.progress import SweepProgress
    from bns.sweep.request import Request

DEVICES = ("cpu", "cuda")
_ON_CPU = "joblib"
_TIME_LIMIT_S = 4 * 3600.0
_ONLY_WITH = {"dask": ("scheduler",), "slurm": ("shards", "time_limit", "slurm", "try_locally", "wait")}


def add_cluster_options(
    parser: argparse.ArgumentParser, positive: Callable[[str], int], duration: Callable[[str], float]
) -> None:
    """Add them; ``positive`` and ``duration`` read whole numbers and times."""
    parser.add_argument("--device", choices=DEVICES, default="cpu", help="cpu (default), or cuda for a GPU (experimental)")
    group = parser.add_argument_group("more than one machine", "see the page From laptop to cluster of the documentation")
    add = group.add_argument
    add(
        "--shard",
        type=_shard,
        metavar="K/N",
        help="only the K-th of N parts of the sweep: one command per machine, one results folder for all",
    )
    add("--executor", metavar="NAME", help=f"{_ON_CPU} (default), dask or slurm")
    add("--scheduler", metavar="tcp://HOST:PORT", help="address of a Dask scheduler (default: start one on this machine)")
    add("--shards", type=positive, metavar="N", help="jobs of the SLURM array (default: 16)")
    add(
        "--time-limit",
        type=duration,
        metavar="TIME",
        help="time limit of each SLURM job (default: 4h)",
    )
    add("--slurm", type=_named, action="append", default=[], metavar="NAME=VALUE", help="option of sbatch (repeatable)")
    add("--try-locally", action="store_true", help="run the SLURM jobs on this machine, as a test")
    add("--wait", action="store_true", help="wait until the SLURM jobs are done")


def say_if_experimental(device: str) -> None:
    """A line on stderr after work on a GPU."""
    if device != "cpu":
        print(
            f"bns: note: --device {device} is experimental: compared on an NVIDIA H100 and an H200 alone. Before you rely on "
            "another GPU, compare some of its results with the CPU's",
            file=sys.stderr,
        )


def backend_name(options: argparse.Namespace) -> str:
    """Name of the executor; SpecError if a GPU and other machines are asked for at once, or for an option of another executor."""
    for executor, names in _ONLY_WITH.items():
        asked = [name for name in names if getattr(options, name) not in (None, False, [])]
        if asked and options.executor != executor:
            words = " and ".join(f"--{name.replace('_', '-')}" for name in asked)
            raise SpecError(f"{words}: only with --executor {executor}. Give that too, or leave {words} out.")
    if options.device == "cpu":
        return options.executor or _ON_CPU
    if options.executor not in {None, options.device} or options.jobs is not None:
        given = "--jobs" if options.jobs is not None else f"--executor {options.executor}"
        raise SpecError(
            f"--device {options.device} is the GPU of this machine, and {given} distributes runs over cores. Leave one of them "
            "out; several machines with a GPU each take --shard K/N."
        )
    return str(options.device)


def request_of(options: argparse.Namespace, bar: SweepProgress) -> Request:
    """What the options of `bns sweep` ask for."""
    from bns.sweep.budget import Budget
    from bns.sweep.request import Request

    return Request(
        results=options.results,
        jobs=options.jobs,
        budget=Budget(options.budget),
        retry_failed=options.retry_failed,
        shard=options.shard,
        on_progress=bar,
        scheduler=options.scheduler,
        shards=options.shards,
        time_limit_s=_TIME_LIMIT_S if options.time_limit is None else options.time_limit,
        options=tuple(options.slurm),
        cluster="local" if options.try_locally else "slurm",
        wait=options.wait,
    )


def _shard(text: str) -> Shard:
    from bns.sweep.expand.shard import Shard

    try:
        return Shard.parse(text)
    except SpecError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _named(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE, as in partition=long")
    return name, value
