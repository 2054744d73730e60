"""What is possible at all in the substitute world, and what limits success: `analysis.ceiling`, `analysis.limits`."""

import numpy as np
import pandas as pd
import pytest

from analysis import ceiling, ensembles, limits, polishing
from bns.engine.philox import Key, Purpose
from bns.robots.base import RandomStream
from bns.tasks import load_task
from bns.worlds.substitute import SubstituteWorld

CIRCLE = load_task("khepera", "circle")


def some_lists(count=5, length=6):
    random = ceiling.ROBOT.random_controllers(Key(1, 2), count, length)
    return [random.controller(number) for number in range(count)]


@pytest.fixture(scope="module")
def evolved():
    return ceiling.evolved(CIRCLE, 1, generations=120)


def test_a_list_succeeds_as_often_as_in_the_substitute_world(evolved):
    world, key = SubstituteWorld(ceiling.ROBOT), Key(7, 8)
    driven = [ceiling.ROBOT.succeeded(world.drive(evolved, key, Purpose.PROBE, step), CIRCLE) for step in range(600)]
    rate = ceiling.judged(evolved, CIRCLE)
    assert 0.2 < rate < 1
    assert abs(np.mean(driven) - rate) < 3.3 * np.sqrt(rate * (1 - rate) / 600) + 1e-9


def test_a_search_ends_above_what_it_began_with_and_within_bounds(evolved):
    found, rate = ceiling.improved(evolved, CIRCLE, 3, steps=40)
    assert ceiling.judged(found, CIRCLE) > ceiling.judged(evolved, CIRCLE)
    assert rate > 0.3
    assert (found >= ceiling.ROBOT.bounds.low).all()
    assert (found <= ceiling.ROBOT.bounds.high).all()
    again, _ = ceiling.improved(evolved, CIRCLE, 3, steps=40)
    np.testing.assert_array_equal(found, again)


def test_two_commands_become_one_of_both_durations_and_the_mean_speed():
    commands = np.array([[3000, 6000, 400], [9000, 6000, 800], [5000, 5000, 500]], np.float32)
    joined = ceiling._joined(commands, 0)
    np.testing.assert_allclose(joined, [[7000, 6000, 1200], [5000, 5000, 500]])


def test_lists_of_different_lengths_are_judged_each_by_itself():
    lists = [*some_lists(3, 4), *some_lists(2, 9)]
    stream = RandomStream(Key(3, 3), 1)
    wide = CIRCLE.__class__("t", "t", "t", np.array([[0.0, 0.1]]), radius_m=0.3)
    together = ceiling.success(lists, wide, 50, stream)
    alone = [ceiling.success([one], wide, 50, stream)[0] for one in lists]
    assert together.max() > 0.2
    # The draws are numbered command by command: a longer list beside it does not change them.
    np.testing.assert_allclose(together, alone)


def rows_of(shares):
    """Evaluations of four seeds: so many of ten evaluations of each succeed, the last ones."""
    rows = []
    for approach, counts in zip(limits.APPROACHES, shares, strict=True):
        for task in ceiling.TASKS:
            for seed, count in enumerate(counts):
                for evaluation in range(1, 11):
                    success = int(evaluation > 10 - count)
                    row = {"task": task, "approach": approach, "seed": seed, "evaluation": evaluation, "success": success}
                    rows.append(row | {"cpu_s": 1.0 + seed})
    return pd.DataFrame(rows)


def test_the_table_compares_pairs_at_the_end_and_over_the_last_five():
    shares = [[0, 0, 1, 2, 3, 5], [1, 2, 3, 4, 5, 5], [2, 3, 4, 5, 5, 5], [5] * 6]
    table = limits.compared(rows_of(shares)).set_index(["task", "approach"])
    plain, new = table.loc["circle", "bns"], table.loc["circle", limits.APPROACHES[2]]
    assert (plain.runs, plain.end, new.end) == (6, pytest.approx(400 / 6), 100)
    assert new["last"] == pytest.approx(100 * 24 / 30)
    assert new.change == pytest.approx(100 * (24 - 20) / 30)
    assert new.change_low <= new.change <= new.change_high
    assert table.loc[("circle", limits.BASE), "change"] == 0
    said = limits.in_words(table.reset_index())[2]
    assert said.startswith(f"| circle | `{limits.APPROACHES[2]}` | 100 % (61–100) | 80 % (")
    assert "| +13 (" in said


def test_what_limits_is_by_approach_and_the_picture_has_a_column_for_each_task():
    drives = pd.DataFrame(
        [
            {"task": task, "approach": name, "simulated": run > 0, "quiet": float(run > 1), "noisy": run / 10}
            for task in ceiling.TASKS for name in limits.APPROACHES for run in range(5)
        ]
    )  # fmt: skip
    found = limits.limits(drives)
    assert found[["simulated", "quiet", "noisy"]].iloc[0].tolist() == pytest.approx([80, 60, 20])
    possible = pd.DataFrame({"task": ceiling.TASKS, "success": [99.0, 98.0, 95.0]})
    figure = limits.drawn(rows_of([[0] * 6, [1] * 6, [2] * 6, [3] * 6]), found, possible)
    assert len(figure.axes) == 6
    assert [line.get_ydata()[0] for ax in figure.axes[3:] for line in ax.lines if len(line.get_ydata()) == 2] == [99, 98, 95]


def test_what_networks_and_generations_gain_is_paired_by_seed_and_the_mean_of_the_tasks():
    gained = {"1 | 20": 0, "3 | 20": 1, "1 | 60": 2, "3 | 60": 4}
    rows, driven = [], []
    for number, task in enumerate(ceiling.TASKS):
        for cell, more in gained.items():
            for seed in range(6):
                # A seed's luck is in all of its cells: pairs leave it out.
                share = (seed % 2 + more * (number > 0)) / 5
                driven.append({"task": task, "approach": cell, "seed": seed, "noisy": share})
                for evaluation in range(1, 11):
                    success = int(evaluation > 10 - round(5 * share))
                    rows.append({"task": task, "approach": cell, "seed": seed, "evaluation": evaluation, "success": success})
    table = ensembles.changes(pd.DataFrame(rows), pd.DataFrame(driven))
    said = ensembles.changes_in_words(table, "last")
    table = table.set_index(["measure", "what", "of"]).sort_index()
    for measure in ("last", "world"):
        both = table.loc[(measure, "both")]
        assert both.loc["circle", "change"] == pytest.approx(0)
        assert both.loc["complex", "change"] == pytest.approx(80)
        assert both.loc["all three", ["change", "change_low", "change_high"]].tolist() == pytest.approx([160 / 3] * 3)
        assert table.loc[(measure, "60 generations, with three networks", "infinity"), "change"] == pytest.approx(60)
    assert said[2] == "| both | 0 (0 to 0) | +80 (+80 to +80) | +80 (+80 to +80) | +53 (+53 to +53) |"
    assert len(said) == 5


def test_what_polishing_gains_is_told_of_the_first_evaluations_too():
    rows, driven = [], []
    for task in ceiling.TASKS:
        for name, early, last in zip(polishing.NAMES.values(), (1, 2), (0, 3), strict=True):
            for seed in range(6):
                driven.append({"task": task, "approach": name, "seed": seed, "noisy": last / 5})
                for evaluation in range(1, 41):
                    success = int(evaluation <= 4 * early or evaluation > 40 - last)
                    rows.append({"task": task, "approach": name, "seed": seed, "evaluation": evaluation, "success": success})
    said = polishing.changes_in_words(polishing.changes(pd.DataFrame(rows), pd.DataFrame(driven)))
    assert said == [
        "| evaluations 1 to 20 |" + 4 * " +20 (+20 to +20) |",
        "| evaluations 56 to 60 |" + 4 * " +60 (+60 to +60) |",
        "| final controllers in the world |" + 4 * " +60 (+60 to +60) |",
    ]
