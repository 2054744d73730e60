"""The commands that carry out sweeps and say what they would cost: sweep, plan."""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict

from bns.cli.compiling import say_if_compiling
from bns.cli.options.option_types import as_json, duration, number, positive
from bns.cli.options.sweep_options import add_cluster_options, backend_name, request_of, say_if_experimental
from bns.cli.parser import Adder, add_results, add_trust
from bns.errors import SpecError
from bns.spec import RunSpec

INTERRUPTED, TERMINATED = 130, 143
_FILES = "sweep files (YAML), or names of those that come with bns: khepera, snake, …"


def add_commands(command: Adder) -> None:
    """The parsers of these commands."""
    many = command("sweep", sweep, "carry out the runs of sweep files; finished runs are skipped")
    many.add_argument("files", nargs="+", metavar="FILE", help=f"{_FILES}; taken in this order")
    many.add_argument("--jobs", type=positive, metavar="N", help="worker processes per machine (default: one per core)")
    many.add_argument(
        "--budget", type=duration, metavar="TIME", help="stop after this time: 90 (s), 10m, 1h30m (shared by all files)"
    )
    add_cluster_options(many, positive, duration)
    many.add_argument("--retry-failed", action="store_true", help="repeat failed and quarantined runs")
    many.add_argument(
        "--confirm-top",
        type=positive,
        metavar="K",
        help="when a sweep is done, run the K best combinations of each task again on fresh seeds, as sweep NAME-confirm",
    )
    many.add_argument(
        "--until",
        choices=("ranking",),
        help="stop when the ten best combinations of each task are known; others get no further runs",
    )
    many.add_argument(
        "--confidence",
        type=number,
        metavar="P",
        help="with --until ranking: confidence, per task, that these are the ten best of the complete sweep (default 0.95; 1: "
        "certainty)",
    )
    many.add_argument(
        "--within",
        type=number,
        metavar="D",
        help="with --until ranking: tolerance; the mean success (0 to 1) of an excluded combination may exceed that of the tenth "
        "by less than D (default: 0)",
    )
    many.add_argument(
        "--dry-run", action="store_true", help="only say how many runs there are, how long they take and how much disk they need"
    )
    costs = command(
        "plan", plan, "estimate what sweeps cost on a laptop, a server and a cluster, from the speed of this machine"
    )
    costs.add_argument("files", nargs="+", metavar="FILE", help=_FILES)
    costs.add_argument("--json", action="store_true", help="print one JSON object")
    for one in (many, costs):
        add_results(one)
        add_trust(one)


def sweep(options: argparse.Namespace) -> int:
    """Runs of sweep files, one file after the other, on one budget."""
    from bns.sweep.confirm import in_turn
    from bns.sweep.executors import load_executor
    from bns.sweep.expand.grid import load_sweeps
    from bns.sweep.forecast.plan import plan as forecast
    from bns.sweep.progress import SweepProgress
    from bns.sweep.ranking.until import run_until_ranked
    from bns.sweep.report import planned, summed_up

    if options.until and (options.confirm_top or options.dry_run):
        other = "--confirm-top" if options.confirm_top else "--dry-run"
        raise SpecError(f"--until {options.until} ends a sweep early, and {other} is about whole ones. Leave one of them out.")
    asked = {name: value for name in ("confidence", "within") if (value := getattr(options, name)) is not None}
    if asked and not options.until:
        raise SpecError(f"{' and '.join(f'--{name}' for name in asked)}: only with --until ranking")
    files = load_sweeps(options.files)
    sweeps = in_turn(files, options.results, options.confirm_top)
    backend = load_executor(backend_name(options))
    with SweepProgress() as bar:
        request = request_of(options, bar)
        if options.device == "cpu":
            say_if_compiling(*(RunSpec(robot=file.robot, **file.combos[0]) for file in files), always=options.dry_run)
        if options.dry_run:
            place = backend.placement(request)
            for one in sweeps:
                estimate = forecast(
                    one, options.results, place.workers, options.shard, retry_failed=options.retry_failed
                )
                print(planned(estimate, place))
            return 0
        failed = 0
        for one in sweeps:
            if options.until:
                summary, ranking = run_until_ranked(backend, one, request, **asked)
                print(ranking.in_words())
            else:
                summary = backend.carry_out(one, request)
            print(summed_up(summary, options.results), file=sys.stderr)
            failed += summary.new_failed
            if summary.stopped_by in {"interrupt", "terminated"}:
                return INTERRUPTED if summary.stopped_by == "interrupt" else TERMINATED
    say_if_experimental(options.device)
    return 1 if failed else 0


def plan(options: argparse.Namespace) -> int:
    """A table of costs; nothing is written."""
    from bns.sweep.expand.grid import load_sweeps
    from bns.sweep.forecast.cost import MACHINES, Cost, Machine, cost_table
    from bns.sweep.forecast.plan import plan as planned
    from bns.sweep.jobs.cores import cores

    plans = [planned(file, options.results, 1) for file in load_sweeps(options.files)]
    costs, machines = [Cost.of(each) for each in plans], (Machine("here", 1, cores()), *MACHINES)
    if options.json:
        sweeps = [
            asdict(p) | asdict(c) | {"seconds_on": {machine.name: c.seconds_on(machine) for machine in machines}}
            for p, c in zip(plans, costs, strict=True)
        ]
        print(as_json({"machines": [asdict(machine) for machine in machines], "sweeps": sweeps}))
        return 0
    print(cost_table(costs, machines))
    print("every core as fast as one of this machine's; from " + "; ".join(f"{p.sweep}: {p.basis}" for p in plans))
    return 0
