"""The order of a sweep's runs: breadth first, shuffled, and the same everywhere."""

from pathlib import Path

from bns.sweep.expand.grid import Sweep
from bns.sweep.expand.order import ordered_specs


def sweep(name: str = "demo", seeds: int = 3, sizes: range = range(10, 60)) -> Sweep:
    return Sweep(name, "khepera", seeds, tuple({"population_size": n} for n in sizes), "", Path("x.yaml"))


def test_seed_by_seed_every_combination_once():
    specs = ordered_specs(sweep())
    assert [spec.seed for spec in specs] == [0] * 50 + [1] * 50 + [2] * 50
    for seed in range(3):
        assert sorted(s.population_size for s in specs if s.seed == seed) == list(range(10, 60))
    assert {spec.robot for spec in specs} == {"khepera"}


def test_shuffle_differs_by_seed_and_name_and_is_no_grid_order():
    sizes = [s.population_size for s in ordered_specs(sweep())]
    assert sizes[:50] != sorted(sizes[:50])
    assert sizes[:50] != sizes[50:100]
    assert sizes != [s.population_size for s in ordered_specs(sweep("other"))]


def test_order_is_pinned():
    # A resumed sweep on another machine or Python must go on in the same order.
    specs = ordered_specs(sweep(sizes=range(10, 16), seeds=1))
    assert [spec.population_size for spec in specs] == [14, 10, 12, 15, 11, 13]


def test_more_combinations_leave_the_order_of_the_others():
    few, many = ordered_specs(sweep(sizes=range(10, 20))), ordered_specs(sweep(sizes=range(10, 30)))
    assert [spec for spec in many if spec.population_size < 20] == few
