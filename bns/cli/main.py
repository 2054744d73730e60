"""The command line: one short function a command, which parses, calls and prints."""

from __future__ import annotations

import argparse
import errno
import os
import re
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

from bns import __version__
from bns.cli import calibrate as calibrating
from bns.cli import diagnose as measuring
from bns.cli import report as reporting
from bns.cli.sweep_options import DEVICES, add_cluster_options, backend_name, request_of
from bns.cli.trial_options import add_looking_options, add_trial_options
from bns.errors import BnsError, SpecError
from bns.spec import FIELDS, RunSpec, checked, field_type

SWEEP_OF_SINGLE_RUNS = "by-hand"
_INTERRUPTED, _TERMINATED = 130, 143
_NO_PLACE = {errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.EACCES, errno.EPERM, errno.EROFS}


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of ``bns``. Exit codes: 0 done, 1 some runs failed, 2 bad input, 130 interrupted, 143 terminated."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by whoever called
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115  # for the life of the process
    warnings.showwarning = _show_warning
    options = _parser().parse_args(arguments)
    try:
        return _flushed(int(options.command(options)))
    except BnsError as error:
        print(f"bns: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("bns: interrupted", file=sys.stderr)
        return _INTERRUPTED
    except BrokenPipeError:  # the reader of our output, `head` say, has what it wants
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except MemoryError:
        print("bns: out of memory; use a smaller population or fewer jobs", file=sys.stderr)
        return BnsError.exit_code
    except OSError as error:
        if error.errno == errno.ENOSPC:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            print(f"bns: cannot write the output: {error.strerror}", file=sys.stderr)
        elif error.errno in _NO_PLACE and error.filename is not None:
            print(
                f"bns: cannot use {error.filename}: {error.strerror}. Name another place, or mend that one.",
                file=sys.stderr,
            )
        else:
            raise
        return BnsError.exit_code


def _flushed(code: int) -> int:
    sys.stdout.flush()  # a full disk or a closed pipe shows here, not when the process ends
    return code


def _show_warning(message: Warning | str, *_place: object, **_more: object) -> None:
    print(f"bns: warning: {message}", file=sys.stderr)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="bns", description="Bootstrapped Neuro-Simulation: runs, sweeps and their results."
    )
    parser.add_argument("--version", action="version", version=f"bns {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(name: str, function: Callable[[argparse.Namespace], int], text: str) -> argparse.ArgumentParser:
        added = commands.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        added.set_defaults(command=function)
        return added

    one = command("run", run, "carry out one run and draw its path")
    _add_spec_options(one)
    one.add_argument(
        "--measurements", type=Path, metavar="FILE", help="also write what was driven as a table (.csv, .parquet)"
    )
    one.add_argument("--save-snn", type=Path, metavar="FILE", help="also write the run's networks as safetensors")
    one.add_argument("--device", choices=DEVICES, default="cpu", help="what computes: cpu (default), or a GPU: cuda")
    one.add_argument(
        "--render",
        type=Path,
        metavar="FILE",
        help="show the fittest controller move, where the world can: .mp4 or .png",
    )
    _add_spec_options(
        taken := command("trial", trial, "carry out a run on a robot, or on its emulator"), without=("world",)
    )
    add_trial_options(taken, _positive)
    add_looking_options(
        command("calibrate", calibrate, "calibrate a camera with a ChArUco board"),
        command("track", track, "show what the tracker of a rig sees"),
        _positive,
        _duration,
    )
    ill = command("doctor", doctor, "find what is wrong with ports, robot, camera and calibration")
    ill.add_argument("--robot", default="khepera")
    ill.add_argument(
        "--rig", type=Path, metavar="FILE", help="your set-up (YAML): its robot and tracker are asked, too"
    )
    many = command("sweep", sweep, "carry out the runs of sweep files; what is done already is skipped")
    many.add_argument("files", nargs="+", type=Path, metavar="FILE", help="sweep files (YAML), taken in this order")
    many.add_argument(
        "--jobs",
        type=_positive,
        metavar="N",
        help="worker processes a machine (default: one a core)",
    )
    many.add_argument(
        "--budget", type=_duration, metavar="TIME", help="stop in time: 90s, 10m, 1h30m (shared by all files)"
    )
    add_cluster_options(many, _positive, _duration)
    many.add_argument("--retry-failed", action="store_true", help="do failed and quarantined runs again")
    many.add_argument(
        "--confirm-top",
        type=_positive,
        metavar="K",
        help="when a sweep is done, run the K best combinations of each task again on fresh seeds, as sweep NAME-confirm",
    )
    many.add_argument(
        "--dry-run", action="store_true", help="say what would be done, how long and how large it would be"
    )
    costs = command(
        "plan", plan, "what sweeps would cost on a laptop, a server and a cluster, from this machine's pace"
    )
    costs.add_argument("files", nargs="+", type=Path, metavar="FILE", help="sweep files (YAML)")
    status_ = command("status", status, "how far the sweeps in a store are")
    ask = command("query", query, "answer an SQL query over evals, runs, specs, paths, generations, probes (DuckDB)")
    ask.add_argument("sql", metavar="SELECT ...")
    ask.add_argument("--csv", action="store_true", help="bare rows, no header")
    look = command("watch", watch, "redraw the page of figures whenever runs finish, until Ctrl-C")
    look.add_argument(
        "results", nargs="?", type=Path, default=Path("results"), metavar="DIR", help="folder of all results"
    )
    look.add_argument(
        "--every", type=_duration, default=10.0, metavar="TIME", help="look again after 10s, 1m, ... (10s)"
    )
    measuring.add_commands(command)
    reporting.add_commands(command)
    calibrating.add_commands(command)
    small = command("compact", compact, "merge small result files, recover journals, upgrade older files")
    planned = command(
        "validate", validate, "evolve controllers on the static simulator, drive each three times in physics"
    )
    planned.add_argument("--robot", default="snake")
    planned.add_argument("--task", help="(default: the last of that robot's study)")
    ready = command("precompute", precompute, "train the static simulator of a robot and write it")
    ready.add_argument("--robot", default="khepera")
    ready.add_argument("-o", "--output", type=Path, metavar="FILE", help="where (default: into the package)")
    ready.add_argument("--jobs", type=_positive, metavar="N", help="processes that drive (default: one a core)")
    for with_results in (one, many, planned, costs, status_, ask, small):
        with_results.add_argument(
            "--results",
            type=Path,
            default=Path("results"),
            metavar="DIR",
            help="folder of all results (default: results)",
        )
    return parser


def _add_spec_options(parser: argparse.ArgumentParser, without: tuple[str, ...] = ()) -> None:
    """One option a parameter, named and explained as in `RunSpec`."""
    for name, field in FIELDS.items():
        if name in without:
            continue
        allowed = field.metadata["choices"]
        text = field.metadata["help"] + (f": {', '.join(allowed)}" if allowed else "")
        parser.add_argument(
            "--" + name.replace("_", "-"),
            type=_of_parameter(name),
            default=None if name == "task" else field.default,
            metavar={int: "N", float: "SHARE", str: "NAME"}[field_type(name)],
            help=f"{text} (default: {'the first of that robot' if name == 'task' else field.default})",
        )


def _of_parameter(name: str) -> Callable[[str], object]:
    def convert(text: str) -> object:
        kind = field_type(name)
        try:
            value = text if kind is str else float(text)
        except ValueError:
            value = text
        try:
            return checked(name, value)
        except SpecError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return convert


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of 1 or more")
    return int(text)


def _duration(text: str) -> float:
    """Seconds of ``90``, ``90s``, ``10m``, ``1h30m``."""
    match = re.fullmatch(r"(?:(\d+(?:\.\d+)?)h)?(?:(\d+(?:\.\d+)?)m)?(?:(\d+(?:\.\d+)?)s?)?", text)
    if not text or match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not a time; write 90s, 10m or 1h30m")
    hours, minutes, seconds = (float(part or 0) for part in match.groups())
    return 3600 * hours + 60 * minutes + seconds


def _say_if_compiling(*specs: RunSpec) -> None:
    from bns.engine.jit import compiled

    if sys.stderr.isatty() and not all(compiled(spec.robot, spec.world) for spec in specs):
        print("bns: compiling the kernels, once on this machine (about 20 s)", file=sys.stderr)


def run(options: argparse.Namespace) -> int:
    """One run by hand: live view, rows in the store, figure of the path."""
    from bns.cli.run import run_by_hand
    from bns.robots import load_robot
    from bns.tasks import default_task

    if options.task is None:
        options.task = default_task(load_robot(options.robot).name)
    spec = RunSpec(**{name: getattr(options, name) for name in FIELDS})
    _say_if_compiling(spec)
    kept = options.save_snn, options.render, options.measurements
    print(run_by_hand(spec, options.results, SWEEP_OF_SINGLE_RUNS, *kept, device=options.device))
    return 0


def trial(options: argparse.Namespace) -> int:
    """A run whose world is a robot; codes 0 done, 2 bad input, 3 paused, 4 a robot that may still be moving."""
    from bns.cli.trial import carried_out

    _say_if_compiling()
    print(carried_out(options, {name: getattr(options, name) for name in FIELDS if name != "world"}))
    return 0


def calibrate(options: argparse.Namespace) -> int:
    """Print the board, or find the lens and the floor of a camera."""
    from bns.cli.camera import calibrated

    print(calibrated(options))
    return 0


def track(options: argparse.Namespace) -> int:
    """Poses, one a line, and annotated frames."""
    from bns.cli.camera import tracked

    print(tracked(options))
    return 0


def doctor(options: argparse.Namespace) -> int:
    """What is fine and what is not; 2 if something is to be mended."""
    from bns.cli.doctor import checked_up

    return checked_up(options)


def sweep(options: argparse.Namespace) -> int:
    """Runs of sweep files, one file after the other, on one budget."""
    from bns.sweep.confirm import in_turn
    from bns.sweep.executors import load_executor
    from bns.sweep.grid import load_sweep
    from bns.sweep.plan import plan as foretell
    from bns.sweep.progress import SweepProgress
    from bns.sweep.report import planned, summed_up

    files = [load_sweep(file) for file in options.files]
    sweeps = in_turn(files, options.results, options.confirm_top)
    backend = load_executor(backend_name(options))
    with SweepProgress() as bar:
        request = request_of(options, bar)
        if options.dry_run:
            place = backend.placement(request)
            for one in sweeps:
                estimate = foretell(
                    one, options.results, place.workers, options.shard, retry_failed=options.retry_failed
                )
                print(planned(estimate, place))
            return 0
        if options.device == "cpu":
            _say_if_compiling(*(RunSpec(robot=file.robot, **file.combos[0]) for file in files))
        failed = 0
        for one in sweeps:
            summary = backend.carry_out(one, request)
            print(summed_up(summary, options.results), file=sys.stderr)
            failed += summary.new_failed
            if summary.stopped_by in {"interrupt", "terminated"}:
                return _INTERRUPTED if summary.stopped_by == "interrupt" else _TERMINATED
    return 1 if failed else 0


def plan(options: argparse.Namespace) -> int:
    """A table of costs; nothing is written."""
    from bns.sweep.cores import cores
    from bns.sweep.cost import MACHINES, Cost, Machine, cost_table
    from bns.sweep.grid import load_sweep
    from bns.sweep.plan import plan as planned

    plans = [planned(load_sweep(file), options.results, 1) for file in options.files]
    here = Machine("here", 1, cores())
    print(cost_table([Cost.of(each) for each in plans], (here, *MACHINES)))
    print("every core as fast as one of this machine's; from " + "; ".join(f"{p.sweep}: {p.basis}" for p in plans))
    return 0


def status(options: argparse.Namespace) -> int:
    """A table of the sweeps."""
    from bns.sweep.report import status_table
    from bns.sweep.status import sweep_status

    print(status_table(sweep_status(options.results)))
    return 0


def query(options: argparse.Namespace) -> int:
    """Rows of a query, as a table or as CSV."""
    from bns.store import query as answer

    rows = answer(options.results, options.sql)
    if options.csv:
        sys.stdout.write(rows.to_csv(index=False, header=False))
    else:
        print(rows.to_string(index=False, max_rows=100) if len(rows) else "no rows")
    sys.stdout.flush()
    return 0


def watch(options: argparse.Namespace) -> int:
    """The page of figures, kept up to date."""
    from bns.cli.watch import watch as keep_drawing

    keep_drawing(options.results, options.every, say=lambda text: print(f"bns: {text}", file=sys.stderr, flush=True))
    return 0


def compact(options: argparse.Namespace) -> int:
    """Merge small files."""
    from bns.store import compact as merge

    print(merge(options.results))
    return 0


def validate(options: argparse.Namespace) -> int:
    """Twelve trials of trajectory planning, and what became of each."""
    from bns.console import counting
    from bns.robots import load_robot
    from bns.static_simulator.transfer_trials import describe, measurements_path, random_drives, table_path, write_table
    from bns.static_simulator.transfer_trials import validate as trials
    from bns.tasks import load_task, task_names
    from bns.worlds import build_world

    robot = load_robot(options.robot)
    name = options.task or max(task_names(robot.name), key=lambda one: load_task(robot.name, one).source)
    task, path = load_task(robot.name, name), table_path(options.results, options.robot, name)
    with counting(f"trials of {robot.name} on {task.title}") as progress:
        table = trials(robot, task, build_world("physics", robot), progress)
    write_table(table, path)
    print(f"{describe(table)}\nwritten to {path}")
    beside = measurements_path(options.results, robot.name)
    if not beside.is_file():
        with counting(f"random controllers of {robot.name}") as progress:
            write_table(random_drives(robot, build_world("physics", robot), progress), beside)
        print(
            f"{beside}: random controllers, to hold a simulator against (bns compare {beside} --model {options.robot})"
        )
    return 0


def precompute(options: argparse.Namespace) -> int:
    """The static simulator, from random commands in the physics world."""
    from bns.console import counting
    from bns.robots import load_robot
    from bns.robots.simulator import save_simulator, static_path
    from bns.static_simulator.train import describe
    from bns.static_simulator.train import precompute as train
    from bns.sweep.cores import cores
    from bns.worlds import build_world

    robot = load_robot(options.robot)
    began, path = time.perf_counter(), options.output or static_path(robot.name)
    with counting(f"training the static simulator of {robot.name}") as progress:
        simulator = train(robot, build_world("physics", robot), progress=progress, jobs=cores(options.jobs))
    save_simulator(simulator, path)
    print(describe(simulator))
    print(f"written to {path} in {time.perf_counter() - began:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
