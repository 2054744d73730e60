"""Crossover and mutation: the kernel against its twin, and what no generation may do."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bns.engine import reference
from bns.engine.breeding import DEFAULT, Operators, breed
from bns.engine.evolution import CommandBounds, Population, random_population, tournament_cdf
from bns.engine.philox import Key

BOUNDS = CommandBounds(*(np.array(v, np.float32) for v in ([-1, 0, 10], [1, 5, 20], [0.5, 1, 3])))
KEY = Key(7, 3)


def parents(n=40, capacity=20, seed=0, lengths=(4, 13)):
    return random_population(Key(seed, 1), n, *lengths, capacity, BOUNDS)


def bred(old, rate=0.0, share=0.2, shortest=4, generation=1, key=KEY, order=None, bounds=BOUNDS,
         operators=DEFAULT):  # fmt: skip
    """Children and the number of those cut short."""
    children = Population(np.full_like(old.commands, -1e6), np.zeros_like(old.lengths))
    order = np.arange(len(old)) if order is None else order
    cdf = tournament_cdf(len(old), share)
    hits = breed(key, old, order, cdf, rate, bounds, shortest, generation, children, operators)
    return children, hits


def everyone(some):
    return np.concatenate([some.controller(i) for i in range(len(some))])


@settings(max_examples=40, deadline=None)
@given(
    n=st.integers(1, 25),
    capacity=st.integers(1, 16),
    rate=st.sampled_from([0, 1e-6, 0.1, 0.5, 1]),
    share=st.sampled_from([0, 0.1, 0.7, 1]),
    shortest=st.integers(1, 12),
    generation=st.integers(0, 2**32 - 1),
    seed=st.integers(0, 2**32 - 1),
    operators=st.builds(Operators, st.tuples(*[st.booleans()] * 3), st.booleans(), st.booleans()),
)
def test_children_are_exactly_the_twins(n, capacity, rate, share, shortest, generation, seed, operators):
    old, key = parents(n, capacity, seed), Key(seed, generation // 2)
    order = np.random.default_rng(seed).permutation(n)
    children, hits = bred(old, rate, share, shortest, generation, key, order, operators=operators)
    cdf = tournament_cdf(n, share)
    slow, origins, slow_hits = reference.breed(
        key, old, order.tolist(), cdf, rate, BOUNDS, shortest, generation, operators
    )
    assert len(children) == len(slow) == n
    for i, (child, origin) in enumerate(zip(slow, origins, strict=True)):
        np.testing.assert_array_equal(children.controller(i), child)
        np.testing.assert_array_equal(children.origin[i, : len(child)], origin)
    assert hits == slow_hits


@pytest.mark.parametrize("inside", [False, True])
def test_lists_of_unequal_length_are_cut_each_at_its_own_place(inside):
    """Two hundred pairs, of which some forty are cut at two places."""
    old, order = parents(401, capacity=40), np.arange(401)
    operators = Operators(cuts_inside=inside)
    children, hits = bred(old, 0.0, 0.0, 1, order=order, operators=operators)
    slow, _, slow_hits = reference.breed(KEY, old, order.tolist(), tournament_cdf(401, 0.0), 0.0, BOUNDS, 1, 1, operators)
    assert hits == slow_hits
    for i, child in enumerate(slow):
        np.testing.assert_array_equal(children.controller(i), child)


def test_readings_of_the_operators_do_what_they_say():
    old = parents(200)
    plain, exact = (everyone(bred(old, 1.0, operators=one)[0]) for one in (DEFAULT, Operators(exact=(False, False, True))))
    np.testing.assert_array_equal(plain[:, :2], exact[:, :2])
    copies = everyone(bred(old)[0])
    kept, moved = copies[:, 2], exact[:, 2] - copies[:, 2]
    free = (kept > 13) & (kept < 17)
    free[: old.lengths[0]] = False  # the elite's
    assert set(np.round(moved[free], 4)) == {-3.0, 3.0}
    assert 0.45 < np.mean(moved[free] > 0) < 0.55
    assert len(set(np.round(plain[free, 2] - kept[free], 4))) > 100
    changed = (everyone(bred(old, 1.0, operators=Operators(one_component=True))[0]) != copies).sum(axis=1)
    assert changed.max() == 1
    assert (changed == 1).mean() > 0.9
    ends = bred(parents(400, lengths=(4, 4)), shortest=1, operators=Operators(cuts_inside=True))[0].lengths
    assert ends.min() == 2  # a command of either parent at least
    assert bred(parents(400, lengths=(4, 4)), shortest=1)[0].lengths.min() == 1


def test_same_key_same_children_another_key_or_generation_others():
    old = parents()
    first = everyone(bred(old, 0.1)[0])
    np.testing.assert_array_equal(first, everyone(bred(old, 0.1)[0]))
    for other in (bred(old, 0.1, key=Key(8, 3)), bred(old, 0.1, generation=2)):
        assert not np.array_equal(first, everyone(other[0]))


@pytest.mark.parametrize("rate", [0.0, 1.0])
def test_the_best_goes_on_unchanged(rate):
    old = parents()
    order = np.roll(np.arange(len(old)), 11)
    children, _ = bred(old, rate, order=order)
    np.testing.assert_array_equal(children.controller(0), old.controller(order[0]))


def test_without_mutation_every_command_is_some_parents():
    old = parents(100)
    genes = {tuple(command) for command in everyone(old)}
    children, _ = bred(old)
    assert {tuple(command) for command in everyone(children)} <= genes
    assert not np.array_equal(children.lengths, old.lengths)


def test_a_child_is_the_front_of_one_parent_and_the_back_of_another():
    old = parents(100, capacity=40)
    origin = {tuple(c): (i, j) for i in range(100) for j, c in enumerate(old.controller(i))}
    children, _ = bred(old)
    mixed = 0
    for i in range(100):
        places = [origin[tuple(command)] for command in children.controller(i)]
        joints = [k for k in range(1, len(places)) if places[k] != (places[k - 1][0], places[k - 1][1] + 1)]
        begins, ends = places[0][1] == 0, places[-1][1] == old.lengths[places[-1][0]] - 1
        assert len(joints) <= 1
        assert (begins and ends) if joints else (begins or ends)
        mixed += bool(joints)
    assert mixed > 40


def test_a_pair_swaps_its_commands():
    """Where both children are mixed, the two together have what their parents had, once each."""
    old = parents(401, capacity=40)
    children, _ = bred(old, shortest=1)
    owner = {tuple(c): i for i in range(401) for c in old.controller(i)}
    checked = 0
    for pair in range(200):
        two = [[owner[tuple(c)] for c in children.controller(i)] for i in (1 + 2 * pair, 2 + 2 * pair)]
        if all(len(set(one)) == 2 for one in two):
            together = np.concatenate([children.controller(i) for i in (1 + 2 * pair, 2 + 2 * pair)])
            both = np.concatenate([old.controller(i) for i in set(two[0])])
            np.testing.assert_array_equal(np.sort(together, axis=0), np.sort(both, axis=0))
            checked += 1
    assert checked > 50


def test_lengths_stay_within_their_bounds_and_cuts_are_counted():
    old, total = parents(60, capacity=14), 0
    for generation in range(1, 60):
        old, hits = bred(old, share=0.0, generation=generation)
        total += hits
        assert old.lengths.min() >= 4
        assert old.lengths.max() <= 14
        assert hits <= (old.lengths[1:] == 14).sum()
    assert total > 0
    assert bred(parents(60, capacity=40))[1] == 0


def test_too_short_a_child_is_not_made():
    old = parents(100, lengths=(4, 5))
    children, _ = bred(old, shortest=5, share=0.0)
    made_long = {tuple(map(tuple, old.controller(i))) for i in range(100)}
    for i in range(100):
        child = children.controller(i)
        assert len(child) >= 5 or tuple(map(tuple, child)) in made_long


def mutated(rate, n=400):
    """Commands before and after mutation, where crossover has nothing to mix: everybody is the same."""
    old = parents(n, lengths=(13, 13))
    old.commands[:] = (BOUNDS.low + BOUNDS.high) / 2
    children, _ = bred(old, rate, shortest=1)
    before = np.tile(old.commands[0, 0], (int(children.lengths[1:].sum()), 1))
    return before, np.concatenate([children.controller(i) for i in range(1, n)])


@pytest.mark.parametrize("rate", [0.0, 0.02, 0.1, 0.5, 1.0])
def test_the_mutated_fraction_is_the_rate(rate):
    before, after = mutated(rate)
    share = (before != after).mean()
    assert abs(share - rate) <= 4 * np.sqrt(rate * (1 - rate) / before.size) + 1e-4 * rate


@pytest.mark.parametrize("rate", [0.05, 1.0])
def test_mutations_are_uniform_within_their_span(rate):
    before, after = mutated(rate)
    for c in range(3):
        move = (after - before)[:, c] / BOUNDS.mutation_span[c]
        move = move[before[:, c] != after[:, c]]
        assert np.abs(move).max() <= 1 + 1e-6
        counts = np.histogram(move, 10, (-1.0001, 1.0001))[0]
        assert (
            (counts - len(move) / 10) ** 2 / (len(move) / 10)
        ).sum() < 27.9  # 9 degrees of freedom, one in a thousand


def test_mutated_commands_stay_within_their_bounds():
    old = parents(200)
    for generation in range(1, 20):
        old, _ = bred(old, 1.0, generation=generation)
        everything = everyone(old)
        assert (everything >= BOUNDS.low).all()
        assert (everything <= BOUNDS.high).all()
    assert (everything == BOUNDS.low).any()  # the bounds were met
    assert (everything == BOUNDS.high).any()


def test_one_controller_is_its_own_only_child():
    old = parents(1)
    children, hits = bred(old, 1.0)
    np.testing.assert_array_equal(children.controller(0), old.controller(0))
    assert hits == 0


def test_lists_of_one_command():
    old = parents(30, capacity=1)
    children, hits = bred(old, share=0.0, shortest=1)
    assert (children.lengths == 1).all()
    assert hits > 0  # two fronts of one command make a list of two


def test_a_tournament_of_all_makes_everybody_a_child_of_the_best():
    old = parents(50)
    children, _ = bred(old, share=1.0, shortest=1, order=np.roll(np.arange(50), -9))
    best = {tuple(c) for c in old.controller(9)}
    assert {tuple(c) for c in everyone(children)} <= best


def with_what_came_before(some):
    """Every command of every controller with the speeds of the one before, which are 0 at first."""
    rows = []
    for i in range(len(some)):
        one = some.controller(i)
        rows.append(np.hstack([np.vstack([np.zeros((1, 2), np.float32), one[:-1, :2]]), one]))
    return np.concatenate(rows)


@pytest.mark.parametrize("rate", [0.0, 0.1, 0.5])
def test_an_origin_is_where_the_same_command_came_after_the_same_speeds(rate):
    old, known = parents(100, capacity=18), []
    for generation in range(1, 12):
        children, _ = bred(old, rate, generation=generation)
        origin = np.concatenate([children.origin[i, :length] for i, length in enumerate(children.lengths)])
        np.testing.assert_array_equal(
            with_what_came_before(children)[origin >= 0], with_what_came_before(old)[origin[origin >= 0]]
        )
        known.append((origin >= 0).mean())
        old = children
    # A command keeps its origin if none of five components mutated, unless a cut brought it a new neighbour.
    assert (1 - rate) ** 5 * 0.85 < np.mean(known) < (1 - rate) ** 5 * 1.05 + 0.02
