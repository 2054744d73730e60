"""The commands that make and try static simulators: precompute, validate."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from bns.cli.options.option_types import positive
from bns.cli.parser import Adder, add_results


def add_commands(command: Adder) -> None:
    """The parsers of these commands."""
    planned = command(
        "validate", validate, "evolve controllers on the static simulator and drive each three times in the physics world"
    )
    planned.add_argument("--robot", default="snake", metavar="NAME", help="robot to validate (default: snake)")
    planned.add_argument("--task", metavar="NAME", help="goal task (default: the last task of that robot's study)")
    planned.add_argument("--sets", type=positive, default=1, metavar="N", help="sets of twelve controllers (default: 1)")
    add_results(planned)
    ready = command("precompute", precompute, "train the static simulator of a robot and write it to a file")
    ready.add_argument("--robot", default="khepera", metavar="NAME", help="robot of the simulator (default: khepera)")
    ready.add_argument("-o", "--output", type=Path, metavar="FILE", help="file to write (default: inside the package)")
    ready.add_argument("--jobs", type=positive, metavar="N", help="processes that simulate drives (default: one per core)")


def validate(options: argparse.Namespace) -> int:
    """Trials of trajectory planning, twelve a set, and what became of each."""
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
        table = trials(robot, task, build_world("physics", robot), progress, options.sets)
    write_table(table, path)
    print(f"{describe(table, len(task.goals_m))}\nwritten to {path}")
    beside = measurements_path(options.results, robot.name)
    if not beside.is_file():
        with counting(f"random controllers of {robot.name}") as progress:
            write_table(random_drives(robot, build_world("physics", robot), progress), beside)
        print(
            f"{beside}: random controllers, to compare a simulator with (bns compare {beside} --model {options.robot})"
        )
    return 0


def precompute(options: argparse.Namespace) -> int:
    """The static simulator, from random commands in the physics world."""
    from bns.console import counting
    from bns.robots import load_robot
    from bns.robots.simulator import save_simulator, static_path
    from bns.static_simulator.train import describe
    from bns.static_simulator.train import precompute as train
    from bns.sweep.jobs.cores import cores
    from bns.worlds import build_world

    robot = load_robot(options.robot)
    began, path = time.perf_counter(), options.output or static_path(robot.name)
    with counting(f"training the static simulator of {robot.name}") as progress:
        simulator = train(robot, build_world("physics", robot), progress=progress, jobs=cores(options.jobs))
    save_simulator(simulator, path)
    print(describe(simulator))
    print(f"written to {path} in {time.perf_counter() - began:.0f} s")
    return 0
