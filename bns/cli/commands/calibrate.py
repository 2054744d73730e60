"""`bns calibrate-body`: the snake's body fitted to what the dissertation published of its random cycles."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path


def add_commands(command: Callable[..., argparse.ArgumentParser]) -> None:
    """The one command, with its options."""
    fitting = command("calibrate-body", calibrate_body, "fit the snake's body to the dissertation's statistics of random cycles")
    fitting.add_argument("--recipe", type=Path, metavar="FILE", help="ranges and targets (default: those of the package)")
    fitting.add_argument(
        "--model",
        type=Path,
        metavar="FILE",
        help="start values of the parameters (default: those of the package)",
    )
    fitting.add_argument("--seed", type=int, default=0, metavar="N", help="seed of the random cycles (default: 0)")
    fitting.add_argument("--jobs", type=int, metavar="N", help="processes that simulate drives (default: one per core)")
    fitting.add_argument("-o", "--output", type=Path, metavar="FILE", help="file to write: the fitted parameters")


def calibrate_body(options: argparse.Namespace) -> int:
    """Fit, print targets beside what was found, and write the parameters where asked."""
    from bns.console import counting
    from bns.physics.snake.parameters import read_parameters, shipped_text
    from bns.robots import load_robot
    from bns.robots.simulator import check_writable
    from bns.static_simulator.calibrate_body import calibrate, describe, read_recipe, shipped_recipe, with_values
    from bns.sweep.jobs.cores import cores

    if options.output is not None:
        check_writable(options.output)
    recipe = read_recipe(_text(options.recipe)) if options.recipe else shipped_recipe()
    text = _text(options.model) if options.model else shipped_text()
    with counting("bodies driven") as progress:
        found = calibrate(
            load_robot("snake"), read_parameters(text), recipe, options.seed, cores(options.jobs), progress
        )
    print(describe(found))
    if options.output is not None:
        part = options.output.with_name(f".{options.output.name}.part")
        part.write_text(with_values(text, found), encoding="utf-8")
        part.replace(options.output)
        print(f"written to {options.output}; drive it with: bns run --robot snake --world {options.output}")
    return 0


def _text(path: Path) -> str:
    from bns.errors import ModelError

    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ModelError(f"cannot read {path}: {error}; give a text file.") from error
