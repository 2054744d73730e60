"""Each check on a made-up store where the finding holds and on one where it does not: agrees, differs."""

from __future__ import annotations

import itertools
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from figure_helpers import with_evals, written
from store.synthetic import publish_chunk, record

from analysis import checks
from analysis.checks import success
from analysis.checks.clusters import _ashman, _intervals, _listed
from analysis.results import NoDataError, Results
from analysis.selection import selections
from bns.spec import RunSpec

EVALUATIONS, SEEDS = 12, 8
RATES, SIZES = (0.1, 0.3, 0.5, 0.7, 0.9), (50, 100, 200, 400)
NEAR = tuple(f"success_{cm}cm" for cm in (7, 10, 14, 20))
steps = np.arange(1, EVALUATIONS + 1)


def store_of(place, runs, robot="khepera", task="circle"):
    """Twenty combinations of mutation rate and population on some seeds; ``runs(rate, size, seed)`` gives columns of evals."""
    specs, rows = [], []
    for rate, size, seed in itertools.product(RATES, SIZES, range(SEEDS)):
        named = {"robot": robot, "task": task, "seed": seed, "mutation_rate": rate, "population_size": size}
        specs.append(RunSpec(evaluations=EVALUATIONS, **named))
        given = runs(rate, size, seed)
        success = np.broadcast_to(given.get("success", False), EVALUATIONS).astype(bool)
        near = dict.fromkeys(NEAR, success if robot == "khepera" else np.full(EVALUATIONS, None))
        ever = np.logical_or.accumulate(success)
        plain = {"ever_success": ever, "diversity": 1.0 + 0.001 * seed, "fitness_world": 0.001 * size - rate}
        row = near | plain | given | {"success": success}
        rows.append({name: np.broadcast_to(value, EVALUATIONS) for name, value in row.items()})
    together = {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}
    publish_chunk(place, f"made-{task}", f"part-j{0:032x}-0", specs, np.random.default_rng(0), **together)


def checked(place, check, task="circle", **arguments):
    store = Results(place)
    return getattr(checks, check)(store, selections(store)[0], task, **arguments)


def both(tmp_path, holds, fails, check, robot="khepera", task="circle", **arguments):
    """Verdicts where it holds and where it does not."""
    found = []
    for name, runs in (("holds", holds), ("fails", fails)):
        store_of(tmp_path / name, runs, robot, task)
        found.append(checked(tmp_path / name, check, task, **arguments).verdict)
    return found


def mixed(share, seed, rate, size):
    """Success in about this share of the evaluations, another one for each run."""
    random = np.random.default_rng([seed, int(100 * rate), size])
    return {"success": random.random(EVALUATIONS) < share}


def test_the_worst_and_the_second_best_value(tmp_path):
    shares = {0.1: 0.9, 0.3: 0.7, 0.5: 0.5, 0.7: 0.5, 0.9: 0.1}
    store_of(tmp_path, lambda rate, size, seed: mixed(shares[rate], seed, rate, size))
    name = {"parameter": "mutation_rate"}
    assert checked(tmp_path, "worst_value", **name, value=0.9).verdict == "agrees"
    assert checked(tmp_path, "worst_value", **name, value=0.1).verdict == "differs"
    assert checked(tmp_path, "second_best", **name, value=0.3).verdict == "agrees"
    assert checked(tmp_path, "second_best", **name, value=0.1).verdict == "differs"
    assert checked(tmp_path, "values_alike", **name, values=[0.5, 0.7], points=15).verdict == "agrees"
    assert checked(tmp_path, "values_alike", **name, values=[0.1, 0.7], points=15).verdict == "differs"
    assert checked(tmp_path, "no_trend", **name, points=3).verdict == "differs"
    assert checked(tmp_path, "no_trend", parameter="population_size", points=15).verdict == "agrees"
    assert checked(tmp_path, "worst_value", **name, value=0.2).verdict == "undecided"  # nobody has it


def test_each_of_the_best_has_half_by_an_evaluation_and_sooner_is_as_good(tmp_path):
    holds = lambda rate, size, seed: {"success": (steps >= 3) & (rate <= 0.5)}  # noqa: E731
    fails = lambda rate, size, seed: {"success": (steps >= 3 + 8 * (size == 400)) & (rate <= 0.5)}  # noqa: E731  # some are late
    assert both(tmp_path, holds, fails, "half_by", evaluation=6) == ["agrees", "differs"]
    assert checked(tmp_path / "holds", "half_by", evaluation=3).verdict == "agrees"
    assert checked(tmp_path / "holds", "half_by", evaluation=2).verdict == "differs"


def test_the_worst_never_succeed(tmp_path):
    holds = lambda rate, size, seed: {"success": rate < 0.5}  # noqa: E731
    assert both(tmp_path, holds, lambda *_: {"success": steps > 5}, "worst_never_succeed") == ["agrees", "differs"]


def test_success_is_lost_and_regained(tmp_path):
    holds = lambda *_: {"success": (steps > 3) & (steps != 7)}  # noqa: E731
    fails = lambda *_: {"success": (steps > 3) & (steps < 9)}  # noqa: E731  # lost for good
    assert both(tmp_path, holds, fails, "convergence_is_lost_and_regained") == ["agrees", "differs"]


def graded(diversity):
    """The lower the mutation rate the better; diversity as given."""
    return lambda rate, size, seed: {
        "success": (steps > 2) & (rate <= 0.5), "diversity": diversity(rate, size) + 0.002 * seed,
    }  # fmt: skip


def test_as_many_of_the_best_as_said_lie_in_a_range(tmp_path):
    holds = graded(lambda rate, size: 0.6 if size > 50 else 3.0)
    fails = graded(lambda rate, size: 3.0)
    assert both(tmp_path, holds, fails, "best_in_range", range=[0.5, 0.7], count=8) == ["agrees", "differs"]


def test_the_best_have_the_wider_range(tmp_path):
    wide = graded(lambda rate, size: 1 + (0.01 * size if rate < 0.5 else 0))
    narrow = graded(lambda rate, size: 1 + (0.01 * size if rate > 0.5 else 0))
    assert both(tmp_path, wide, narrow, "best_have_a_range", than_worst="wider") == ["agrees", "differs"]
    assert checked(tmp_path / "fails", "best_have_a_range", than_worst="narrower").verdict == "agrees"


def test_the_worst_end_near_the_largest_diversity_or_wander(tmp_path):
    holds = graded(lambda rate, size: 1 + rate)
    fails = graded(lambda rate, size: 5 - 4 * rate)
    assert both(tmp_path, holds, fails, "diversity_of_worst_saturates") == ["agrees", "differs"]
    rising = lambda rate, size, seed: {"success": steps > 12 * rate, "diversity": 1 + steps / 5 + 0.01 * seed}  # noqa: E731
    store_of(tmp_path / "rising", rising)
    assert checked(tmp_path / "holds", "diversity_of_worst_goes_nowhere").verdict == "agrees"
    assert checked(tmp_path / "rising", "diversity_of_worst_goes_nowhere").verdict == "differs"


def test_low_diversity_spreads_error_and_success(tmp_path):
    def spread(low):
        def runs(rate, size, seed):
            number = RATES.index(rate) * 4 + SIZES.index(size)
            odd = (number % 2) * ((number < 5) == low)
            return {"diversity": 1.0 + number, "fitness_error": 1.0 + odd + 0.01 * number, "success": steps > 6 * odd}

        return runs

    assert both(tmp_path, spread(True), spread(False), "low_diversity_spreads", measure="fitness_error") == ["agrees", "differs"]


@pytest.mark.slow
def test_two_clusters_and_whose_the_lower_one_is(tmp_path, monkeypatch):
    def at(middle):
        def runs(rate, size, seed):
            return {"diversity": middle(rate) + 0.1 * np.random.default_rng([int(100 * rate), size]).normal()}

        return runs

    two, one = at(lambda rate: 2.0 if rate == 0.1 else 3.4), at(lambda rate: 2.0 + 0.1 * rate)
    where = {"robot": "snake", "task": "two-regions"}
    assert both(tmp_path, two, one, "two_clusters", **where, centres=[2, 3.4]) == ["agrees", "differs"]
    elsewhere = checked(tmp_path / "holds", "two_clusters", "two-regions", centres=[1, 3.4])
    assert (elsewhere.verdict, elsewhere.ours.startswith("best two at 2.0")) == ("differs", True)
    monkeypatch.setitem(globals(), "SIZES", tuple(range(50, 650, 50)))
    store_of(tmp_path / "three", at(lambda rate: {0.1: 1.0, 0.3: 2.5}.get(rate, 4.0)), "snake", "two-regions")
    three = checked(tmp_path / "three", "two_clusters", "two-regions", centres=[2, 3.4])
    assert (three.verdict, three.ours[:36]) == ("differs", "3 describe them better than two, at ")
    lower = [
        checked(tmp_path / "holds", "lower_cluster_is", "two-regions", parameter="mutation_rate", value=value).verdict
        for value in (0.1, 0.9)
    ]
    assert lower == ["undecided", "differs"]  # 20 combinations of 20 leave a lower end of 84 %


def test_a_large_population_removes_most_bad_combinations(tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "RATES", tuple(np.round(np.linspace(0.05, 0.95, 19), 2)))
    monkeypatch.setitem(globals(), "SEEDS", 5)
    holds = lambda rate, size, seed: {"success": size == 400 or rate < 0.2}  # noqa: E731
    fails = lambda rate, size, seed: {"success": size < 400}  # noqa: E731
    assert both(tmp_path, holds, fails, "large_population_has_fewer_bad") == ["agrees", "differs"]
    store_of(tmp_path / "some", lambda rate, size, seed: {"success": rate < (0.4 if size == 400 else 0.1)})
    some = checked(tmp_path / "some", "large_population_has_fewer_bad")  # fewer for sure (p = 0.002), but not half of them
    assert (some.verdict, some.ours[:37]) == ("undecided", "12 of 19 are bad, 54 of 57 with small")


def test_a_task_needs_more_evaluations_than_another(tmp_path):
    for name, late in (("holds", 10), ("fails", 4)):
        store_of(tmp_path / name, lambda *_: {"success": steps >= 3}, "snake", "two-regions")
        store_of(tmp_path / name, lambda *_, late=late: {"success": steps >= late}, "snake", "three-regions")
    found = [checked(tmp_path / name, "needs_more_than", "three-regions", times=2, of=1) for name in ("holds", "fails")]
    assert [one.verdict for one in found] == ["agrees", "differs"]
    assert found[0].ours == "3.3 (3.3 to 3.3) times"
    store_of(tmp_path / "alone", lambda *_: {"success": steps >= 3}, "snake", "three-regions")
    with pytest.raises(NoDataError, match="no runs of task 1"):
        checked(tmp_path / "alone", "needs_more_than", "three-regions", times=2, of=1)


def test_what_single_runs_show_over_time(tmp_path):
    for name, good in (("holds", True), ("fails", False)):
        runs = []
        for seed, rate in itertools.product(range(10), (0.1, 0.5)):
            spec = RunSpec(seed=seed, mutation_rate=rate, evaluations=EVALUATIONS, record="full")
            made = record(spec, ("evals", "generations", "probes"))
            order = steps if good else steps[::-1]
            of_probes = made.tables["probes"]["evaluation"].astype(int)
            shrinking = 1 / order[of_probes - 1]
            made.tables["probes"] |= {"distance_m": shrinking, "change_m": shrinking}
            many = len(made.tables["generations"]["evaluation"])
            in_world = np.full(many, 0.5 if good else 1.5)
            made.tables["generations"] |= {"best_fitness": np.ones(many), "best_fitness_world": in_world}
            runs.append(made)
        written(tmp_path / name, "made", runs)
        # Of another world than the study's: the other way round, and not counted.
        elsewhere = record(RunSpec(world="physics", evaluations=EVALUATIONS, record="full"), ("evals", "generations"))
        elsewhere.tables["generations"] |= {"best_fitness": in_world, "best_fitness_world": np.ones(many)}
        written(tmp_path / name, "prototype-physics", [elsewhere])
    for check in ("world_is_mostly_below", "probes_settle", "simulators_change_less"):
        found = [checked(tmp_path / name, check) for name in ("holds", "fails")]
        assert [one.verdict for one in found] == ["agrees", "differs"], check
        assert [one.ours.partition(" runs")[0] for one in found] == ["in 20 of 20", "in 0 of 20"]
    store_of(tmp_path / "plain", lambda *_: {})
    with pytest.raises(NoDataError, match="no stored run of the study's settings has generations and probes"):
        checked(tmp_path / "plain", "world_is_mostly_below")


def test_from_too_few_seeds_there_are_estimates_and_no_verdict(tmp_path):
    made = []
    for rate, size in itertools.product(RATES, SIZES):
        for seed in range(2):
            spec = RunSpec(seed=seed, evaluations=EVALUATIONS, mutation_rate=rate, population_size=size)
            made.append(with_evals(spec, **dict.fromkeys((*NEAR, "success"), steps > 12 * rate)))
    written(tmp_path, "few", made, sweep_text=f"name: few\nrobot: khepera\nseeds: 2\ngrid: {{mutation_rate: {list(RATES)}}}\n")
    found = checked(tmp_path, "worst_value", parameter="mutation_rate", value=0.9)
    assert (found.verdict, found.ours) == ("undecided", "worst 90 % over all evaluations")
    assert checked(tmp_path, "half_by", evaluation=6).verdict == "undecided"


def test_clusters_lie_apart_by_their_usual_width_and_means_are_as_sure_as_their_own_values_are_many():
    mixture = SimpleNamespace(
        means_=np.array([[3.0], [1.0]]), covariances_=np.array([0.36, 0.04]).reshape(2, 1, 1), weights_=np.array([0.75, 0.25])
    )
    assert _ashman(mixture) == pytest.approx(2.0 / np.sqrt(0.2))
    low, high = np.array(_intervals(mixture, 48)).T
    assert low == pytest.approx([1.0 - 1.96 * 0.2 / np.sqrt(12), 3.0 - 1.96 * 0.6 / 6], abs=1e-4)
    assert high == pytest.approx([1.0 + 1.96 * 0.2 / np.sqrt(12), 3.0 + 1.96 * 0.6 / 6], abs=1e-4)
    assert _listed(mixture) == "1.00 and 3.00"


def test_of_what_is_gained_the_late_share_is_that_behind_the_middle():
    assert success._late_share(np.array([[0.2, 0.4, 1.0], [0.0, 0.6, 0.6]])) == pytest.approx([75, 0])
    assert np.isnan(success._late_share(np.array([0.5, 0.6, 0.5])))


def test_a_sample_that_never_comes_to_a_half_counts_as_one_evaluation_after_the_last(monkeypatch):
    """Of eight seeds four succeed from the third evaluation on: fewer than a half in many a sample."""
    seeds = pd.DataFrame({"root_seed": 0, "seed": np.arange(8), "runs": 1})
    rows = pd.concat([seeds.assign(evaluation=at, successes=(seeds.seed < 4) & (at >= 3)) for at in range(1, 6)])
    monkeypatch.setattr(success, "ever_by_seed", lambda *_: rows.assign(successes=rows.successes.astype(int)))
    first, samples = success._until_half(None, None, "circle")
    assert first == 3
    assert set(samples) == {3, 6}
