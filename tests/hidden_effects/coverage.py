"""How far fitted numbers are from the truth, in standard errors: worlds' true effects fitted from the truth, without a search.

``python -m tests.hidden_effects.coverage --only new- --seeds 31,32``: for every number the mean of (value - truth)/standard
error over the seeds (a bias, where it is far from 0), its standard deviation (an interval too narrow, where it is above 1), and
how often the truth lies in the 95 % interval. ``--clean``: without noise of camera and motors, which leaves the equations' own
errors, in standard errors of the noisy fit. ``--bootstrap N``: each fit again with N draws of the trials, another way to an
interval: the widths' ratio.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bns.diagnose.data.load import load_measured
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.jagged import with_jagged
from bns.diagnose.estimate.problem import problem_for, problem_with_noise
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.wheels import predictor_for_search
from bns.physics.model import Model
from tests.hidden_effects.camera import Camera
from tests.hidden_effects.plan import select, worlds
from tests.hidden_effects.world import World, write

SILENT = Camera(1e-7, 1e-7, 1e-9, 1e-9, lost=0.0)


@dataclass
class Found:
    """Of one number of a world, an entry a seed."""

    z: list[float] = field(default_factory=list)
    inside: list[bool] = field(default_factory=list)
    clean: list[float] = field(default_factory=list)
    widths: list[float] = field(default_factory=list)


def seen(world: World) -> Predictor:
    """The world's log as the diagnosis reads it."""
    with tempfile.TemporaryDirectory() as folder:
        return predictor_for_search(load_measured(write(world, Path(folder), [])).tracks)


def true_model(world: World, predictor: Predictor) -> Model:
    """With the hidden effects at their true values."""
    model = Model(wheelbase_m=world.nominal.wheelbase_m)
    there = listed(model, None, predictor.tracks)
    for name, given in world.hidden.items():
        values = there[name].neutral | ({"share": 1.0} if name in {"command-quantisation", "command-truncation"} else {}) | given
        model = model.with_active(there[name], tuple(values[p.name] for p in there[name].parameters))
    return model


def fitted(predictor: Predictor, true: Model) -> tuple[Problem, Fit]:
    """Noise and numbers settled together, from the truth."""
    problem = problem_for(predictor, true)
    problem = problem_for(predictor, problem.fit(true).model, problem.pose_filter.noise)
    return problem, with_jagged(problem, problem.fit(true))


def drawn(problem: Problem, fit: Fit, draws: int) -> Iterator[np.ndarray]:
    """Values (p,) of fits to trials drawn with replacement."""
    rng, trials = np.random.default_rng(7), len(fit.losses)
    for _ in range(draws):
        often = rng.multinomial(trials, np.full(trials, 1 / trials)).astype(float)
        yield Problem(problem.predictor, problem.pose_filter, often[problem.predictor.tracks.trial]).fit(fit.model).values


def look(world: World, out: dict[tuple[str, str], Found], clean: bool, draws: int) -> None:
    """One world's numbers, added to ``out``."""
    predictor = seen(world)
    true = true_model(world, predictor)
    problem, fit = fitted(predictor, true)
    values = [(number, number.of(true)) for number in fit.free]
    if clean:
        quiet = seen(replace(world, camera=SILENT, jitter=0.0))
        bare = problem_with_noise(quiet, quiet.steps(true), problem.pose_filter.noise).fit(true)
    again = np.array(list(drawn(problem, fit, draws)))
    for i, (number, truth) in enumerate(values):
        low, high = fit.interval(i)
        found, se = out[world.name, number.parameter.name], fit.se(i)
        found.inside.append(bool(low <= truth <= high))
        if se > 0:
            found.z.append((fit.values[i] - truth) / se)
        if se > 0 and clean:
            found.clean.append((bare.values[i] - truth) / se)
        if draws:
            found.widths.append((high - low) / max(float(np.ptp(np.quantile(again[:, i], [0.025, 0.975]))), 1e-300))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.hidden_effects.coverage", description=__doc__)
    parser.add_argument("--only", default="new-", help="worlds with this in their family or name (new-)")
    parser.add_argument("--seeds", default="0", help="seeds, with commas (0)")
    parser.add_argument("--clean", action="store_true", help="also the error without any noise")
    parser.add_argument("--bootstrap", type=int, default=0, metavar="N", help="also N draws of the trials (0)")
    options = parser.parse_args()
    out: dict[tuple[str, str], Found] = defaultdict(Found)
    for seed in map(int, options.seeds.split(",")):
        for world in select(worlds(seed), options.only, False):
            if world.hidden and not world.unlisted:
                look(world, out, options.clean, options.bootstrap)
    for (name, number), found in out.items():
        text = f"{name:40} {number:14} "
        text += f"mean {np.mean(found.z):6.2f}  sd {np.std(found.z):5.2f}" if found.z else "no standard error: at a bound"
        text += f"  inside {sum(found.inside)} of {len(found.inside)}"
        text += f"  without noise {np.mean(found.clean):6.2f}" if found.clean else ""
        print(text + (f"  width over bootstrap's {np.mean(found.widths):5.2f}" if found.widths else ""))
    inside = [one for found in out.values() for one in found.inside]
    print(f"{sum(inside)} of {len(inside)} numbers in their 95 % interval")


if __name__ == "__main__":
    main()
