"""How many runs `--until ranking` needs, and for how many studies it finds the same winners: `make ranking-check`.

Complete studies are drawn again and again: from rates of all sizes, and from the rates of the published study (a beta
distribution a task, fitted to its runs). Each is run as the race would run it, and its winners are compared with those
of the complete study. Beside the share of runs stands the least that any rule needs (`least_runs`), even one that is
told how good the last of the winners is, and works on each combination alone.
"""

import argparse
from dataclasses import dataclass
from functools import cache
from math import comb
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.optimize import minimize
from scipy.stats import betabinom

from bns.sweep.ranking.race import Aim, Results, next_runs

ARCHIVE = Path(__file__).resolve().parents[2] / "results" / "published" / "study.parquet"
COMBINATION = ["population_size", "tournament_size", "mutation_rate", "real_world_selection_size"]
TOP = 10
WEIGHTS = np.concatenate([[0.0], np.geomspace(1.0, 3000.0, 24)])


def raced(outcomes, aim=Aim(TOP, confidence=1.0), rounds=10**6):  # noqa: B008  # frozen
    """What a race reveals of a complete study (combinations, seeds)."""
    results = Results(np.full(outcomes.shape, np.nan), np.zeros(outcomes.shape, bool))
    while rounds and (batch := next_runs(results, aim)):
        at = tuple(np.array(batch).T)
        assert not results.seen[at].any()
        results.seen[at], results.success[at] = True, outcomes[at]
        rounds -= 1
    return results


def ranked(means, among=None):
    """The best, of equals the first."""
    order = np.argsort(-means, kind="stable")
    return [n for n in order.tolist() if among is None or among[n]][:TOP]


@dataclass(frozen=True)
class Outcome:
    """Of one study: share of runs, whether the winners and their order are the same, how much better the best lost one is."""

    share: float
    same: bool
    lost: float


def outcome(outcomes, aim):
    """Of a race over a complete study."""
    results, means = raced(outcomes, aim), outcomes.mean(axis=1)
    mine, true = ranked(means, results.whole), ranked(means)
    missed = means[[n for n in true if n not in mine]]
    lost = float(missed.max() - means[mine[-1]]) if len(missed) else 0.0
    return Outcome(float(results.seen.mean()), mine == true, lost)


def spread_rates(centre, combinations):
    """Rates of all sizes: normally distributed log odds."""
    return lambda draw: 1 / (1 + np.exp(-(2.5 * draw.standard_normal(combinations) + centre)))


def published_rates(task, combinations):
    """Rates like those of the published study: a beta distribution fitted to the counts of its combinations."""
    runs = pd.read_parquet(ARCHIVE, columns=["sweep", "task", "success_bits", *COMBINATION])
    runs = runs[(runs["sweep"] == "khepera") & (runs["task"] == task)]
    counts = runs.assign(success=[int(bits[-1]) & 1 for bits in runs["success_bits"]]).groupby(COMBINATION)["success"]
    won, tried = counts.sum(), counts.count()
    # Mean and size of the beta distribution; a size of thousands is one rate for all, on this many runs.
    fitted = minimize(
        lambda at: -betabinom.logpmf(won, tried, *_beta(at)).sum(), [0.0, 1.0], method="Nelder-Mead", bounds=[(-5, 5), (-2, 8)]
    )
    return lambda draw: draw.beta(*_beta(fitted.x), combinations)


def _beta(at):
    mean, size = 1 / (1 + np.exp(-at[0])), np.exp(at[1])
    return mean * size, (1 - mean) * size


@cache
def least_runs(total, other, seeds, wrong):
    """Runs on average before any rule may tell a combination of that total from one of another; a bound from below.

    The rule errs with a chance of ``wrong`` at most for either. Its best form is a stopping problem for each price of
    the errors, solved backwards over (runs, successes); weak duality makes each price's value a bound (Kaufmann, Cappe
    and Garivier, JMLR 2016, treat draws with replacement by an inequality that this is sharper than).
    """
    price = WEIGHTS[:, None], WEIGHTS[None, :]
    later = {}
    for n in range(seeds, -1, -1):
        now = {}
        for k in range(n + 1):
            here, there = (_chance(n, k, value, seeds) for value in (total, other))
            value = np.minimum(price[0] * here, price[1] * there)
            if n < seeds:
                value = np.minimum(value, here + later[k] + later[k + 1])
            now[k] = value
        later = now
    return float(max((later[0] - wrong * (price[0] + price[1])).max(), 0.0))


def _chance(n, k, total, seeds):
    """Of one order of k successes in n draws without replacement."""
    return comb(seeds - n, total - k) / comb(seeds, total) if 0 <= total - k <= seeds - n else 0.0


def least_share(outcomes, wrong=0.05):
    """A bound from below on the share of runs: each combination against being just on the other side of the last place."""
    totals, seeds = outcomes.sum(axis=1).astype(int).tolist(), outcomes.shape[1]
    order = np.argsort(-outcomes.sum(axis=1), kind="stable").tolist()
    tenth, next_best = totals[order[TOP - 1]], totals[order[TOP]]
    need = [least_runs(totals[n], max(next_best - 1, 0), seeds, wrong) for n in order[:TOP]]
    need += [least_runs(totals[n], min(tenth + 1, seeds), seeds, wrong) for n in order[TOP:] if tenth < seeds]
    return sum(need) / outcomes.size


def main():
    """A line for each kind of study and each difference that is let pass."""
    parser = argparse.ArgumentParser(prog="python -m tests.sweep.ranking_study", description=__doc__)
    parser.add_argument("--studies", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    kinds = {f"75 combinations, centre {centre:+}": spread_rates(centre, 75) for centre in (-2.0, -0.5, 1.0)}
    kinds["500 combinations, centre -2"] = spread_rates(-2.0, 500)
    kinds |= {f"published, {task}": published_rates(task, 500) for task in ("infinity", "complex", "circle")}
    columns = " | ".join(f"within {d:<4g} share  same  right" for d in (0.0, 0.1, 0.2))
    print(f"{'study':30} {'certain':>8} | {columns} | bound")
    for kind, rates in kinds.items():
        draw, rows, bounds = np.random.default_rng(options.seed), {}, []
        for _ in range(options.studies):
            rate = rates(draw)
            outcomes = (draw.random((len(rate), 30)) < rate[:, None]).astype(float)
            bounds.append(least_share(outcomes))
            for aim in (Aim(TOP, 1.0), *(Aim(TOP, within=within) for within in (0.0, 0.1, 0.2))):
                rows.setdefault(aim, []).append(outcome(outcomes, aim))
        certain, *told = (
            (np.mean([o.share for o in found]), sum(o.same for o in found), sum(o.lost < max(aim.within, 1e-9) for o in found))
            for aim, found in rows.items()
        )
        cells = " | ".join(f"{share:17.1%} {same:5} {right:6}" for share, same, right in told)
        print(f"{kind:30} {certain[0]:8.1%} | {cells} | {np.mean(bounds):.1%}", flush=True)


if __name__ == "__main__":
    main()
