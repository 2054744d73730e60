"""What parameters do in two worlds, and what the dissertation's advice costs."""

import numpy as np
import pandas as pd
import pytest
from figure_helpers import with_evals, written

from analysis import advice, random_behaviour, worlds
from analysis.labels import CELL
from analysis.replication.numbers import Study, by_either_reading
from analysis.replication.page import page
from analysis.results import NoDataError, Results
from analysis.selection import comparing
from bns.spec import RunSpec

EVALUATIONS = 10


def runs_in_two_worlds(place, seeds=6):
    """In the physics world low mutation is 40 points better, in the substitute world the population; of seed 9 one run alone."""
    made = []
    for seed in range(seeds):
        for world in ("substitute", "physics"):
            for population in (50, 400):
                for rate in (0.1, 0.9):
                    good = rate == 0.1 if world == "physics" else population == 400
                    late = np.arange(EVALUATIONS) >= (EVALUATIONS - 2 if good else EVALUATIONS - 1)
                    cell = {"population_size": population, "mutation_rate": rate}
                    made.append(with_evals(RunSpec(seed=seed, world=world, evaluations=EVALUATIONS, **cell), success=late))
    odd = RunSpec(seed=9, world="physics", evaluations=EVALUATIONS, population_size=50, mutation_rate=0.9)
    written(place, "worlds", [*made, with_evals(odd, success=np.ones(EVALUATIONS, bool))])
    return Results(place)


def test_each_world_has_its_own_order_of_influence_and_a_seed_that_is_not_whole_does_not_count(tmp_path):
    store = runs_in_two_worlds(tmp_path)
    rows = worlds.influences(worlds.of_each_run(store)).set_index(["world", "parameter"])
    assert set(rows.seeds) == {6}
    mutation, population = "mutation_rate", "population_size"
    for world, matters, other in (("physics", mutation, population), ("substitute", population, mutation)):
        strong, weak = rows.loc[world, matters], rows.loc[world, other]
        assert (strong.points, strong.low, strong.high, strong.widest) == (50, 50, 50, 1)
        assert (weak.points, weak.widest) == (0, 0)
    assert (rows.loc[("physics", "mutation_rate"), ["best", "worst"]] == [0.1, 0.9]).all()
    said = worlds.table(rows.reset_index())
    assert said["physics world (points)"].tolist() == [
        "0 (0 to 0): 50 above 50; the widest in 0%", "50 (50 to 50): 10 % above 90 %; the widest in 100%",
    ]  # fmt: skip
    assert [one.name for one in worlds.draw(store)] == ["worlds-khepera"]


def test_runs_of_several_worlds_stand_in_no_other_figure(tmp_path):
    assert comparing(runs_in_two_worlds(tmp_path, 1), None) == []
    written(tmp_path / "other", "mine", [with_evals(RunSpec(seed=1, evaluations=4))])
    with pytest.raises(NoDataError, match="no sweep has the same combinations in two worlds"):
        worlds.draw(Results(tmp_path / "other"))


def combinations(rates, populations):
    grid = [(p, 0.5, m, 0.5) for p in populations for m in rates]
    return pd.DataFrame(grid, columns=list(CELL)).sort_values(list(CELL)).reset_index(drop=True)


def judged(means, seeds=10, stream=0):
    """Successes of 20 evaluations with these means (combinations,)."""
    cells = combinations((0.1, 0.5, 0.9), (50, 400))
    sums = np.random.default_rng(stream).binomial(20, np.broadcast_to(means, (seeds, len(cells)))).astype(float)
    return cells, sums, np.full(sums.shape, 20.0)


def test_the_regret_is_what_the_best_has_more_than_the_advice():
    cells, _, _ = judged(np.zeros(6))
    advised = (cells.population_size == 400) & (cells.mutation_rate == 0.1)
    means = np.where(advised, 0.5, 0.2)
    means[0] = 0.8
    row = advice.regret(*judged(means), "circle")
    assert (row["seeds"], row["combinations"], row["advised"]) == (10, 6, 1)
    assert row["regret_low"] < 30 < row["regret_high"]
    assert row["gain"] == pytest.approx(row["advice"] - row["random"])
    assert advice.table("khepera", pd.DataFrame([row]))["the best (%)"][0].startswith(f"{row['best']:.0f} (")


def test_luck_is_no_regret():
    """Of equal combinations the luckiest is no better on seeds that it was not chosen by."""
    regrets = [advice.regret(*judged(np.full(6, 0.5), seeds=6, stream=stream), "circle")["regret"] for stream in range(40)]
    assert abs(np.mean(regrets)) < 3 * np.std(regrets) / np.sqrt(40)
    by_counts = [judged(np.full(6, 0.5), seeds=6, stream=stream)[1].mean(axis=0).max() * 5 - 50 for stream in range(40)]
    assert np.mean(by_counts) > 5  # what choosing and judging on the same seeds would have called regret


def test_without_seeds_or_choice_there_is_no_regret():
    cells, sums, counts = judged(np.full(6, 0.5))
    assert advice.regret(cells, sums[:4], counts[:4], "circle") is None
    assert advice.regret(cells.assign(population_size=50), sums, counts, "circle") is None
    assert advice.regret(cells, sums, np.where(np.arange(10)[:, None] < 7, 0.0, counts), "circle") is None  # 3 whole seeds


def test_success_so_far_is_that_of_any_earlier_evaluation_in_every_radius(tmp_path):
    now = np.arange(EVALUATIONS) == 3
    spec = RunSpec(seed=1, evaluations=EVALUATIONS)
    ever = {"ever_success": np.cumsum(now) > 0, "ever_success_14cm": np.ones(EVALUATIONS, bool)}
    written(tmp_path, "mine", [with_evals(spec, success=now, success_14cm=now, **ever)])
    for so_far, wanted, wide in ((False, 1, 1), (True, 7, 10)):
        found = Results(tmp_path, so_far=so_far).query(
            "SELECT count(*) FILTER (success) AS own, count(*) FILTER (success_14cm) AS wide FROM evals"
        )
        assert (found.own[0], found.wide[0]) == (wanted, wide)


def test_findings_that_depend_on_whose_success_is_meant_stand_side_by_side():
    def study(ours, verdict):
        claims = zip(("gap", "diversity"), ours, verdict, strict=True)
        rows = [("1, circle", "figure 4.7", *more) for more in claims]
        rows.append(("1, circle", "section 4.4", "success is lost and regained in some runs", ours[0], verdict[0]))
        return Study(None, None, pd.DataFrame(rows, columns=["task", "where", "the dissertation", "these results", "verdict"]))

    rows = by_either_reading(study(["22", "4"], ["differs", "differs"]), study(["46", "4"], ["replicates", "differs"]))
    assert rows["the dissertation"].tolist() == ["gap"]
    text = page([], rows, None, [], [], None, [], {}, [])
    assert "| 1, circle | figure 4.7 | gap | 22; **differs** | 46; **replicates** |" in text
    assert "| now | 0 | 1 | 0 |" in text
    assert "| so far | 1 | 0 | 0 |" in text


def test_simulators_are_compared_on_random_behaviour_by_seed():
    draws = np.random.default_rng(0)
    luck = draws.normal(0.3, 0.1, 8)
    rows = [("circle", pre, seed, 40, luck[seed] + (0.0 if pre else 0.05)) for seed in range(8) for pre in (False, True)]
    rows.append(("circle", True, 99, 40, 5.0))  # a seed without its partner
    runs = pd.DataFrame(rows, columns=["task", "precomputed", "seed", "evaluations", "distance_m"])
    row = random_behaviour.compared(runs).iloc[0]
    assert (row.seeds, row.drives) == (8, 40)
    assert [row.difference, row.difference_low, row.difference_high] == pytest.approx([0.05] * 3)
    assert row.bns_low < row.bns < row.bns_high
    assert random_behaviour.table(pd.DataFrame([row]))["difference (cm)"][0] == "5.0 (5.0 to 5.0)"
    with pytest.raises(NoDataError, match="no seed of the sweep random-behaviour has both"):
        random_behaviour.compared(runs[runs.precomputed])
