"""What a formula's value is with parts of it kept from the call before: the same as without, to the last bit."""

import gc
import pickle
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from bns.physics import formula_value
from bns.physics.formula_value import Ago, Compiled

CURVE = "k0 * max(min((0.1 - abs(v)) / 0.1, 1), 0) * w + k1 * w * abs(v) + k2 * v**3 - (k3 + 2 * 3) * sin(v * k3) / exp(w)"
N = 3000


@pytest.fixture
def kept(monkeypatch):
    """Nothing is kept from tests before."""
    parts = formula_value._Parts()
    monkeypatch.setattr(formula_value, "_KEPT", parts)
    return parts


def velocities(seed=0, n=N):
    draws = np.random.default_rng(seed)
    return {"v": draws.normal(size=(2, n // 2)), "w": draws.normal(size=(2, n // 2))}


def numbers(seed):
    return dict(zip(["k0", "k1", "k2", "k3"], np.random.default_rng(seed).normal(size=4).tolist(), strict=True))


@pytest.mark.parametrize("n", [20, N])
def test_kept_parts_change_no_bit(kept, n):
    term = Compiled("curve", CURVE)
    for seed in range(3):
        values = velocities(seed // 2, n) | numbers(seed)
        np.testing.assert_array_equal(term.value_of_numbers(values), term.value(values))


def test_parts_are_worked_out_once_for_any_numbers(kept, monkeypatch):
    term, values, asked = Compiled("curve", CURVE), velocities(), []
    whole = formula_value._Split.worked_out
    monkeypatch.setattr(formula_value._Split, "worked_out", lambda split, v: asked.append(1) or whole(split, v))
    for seed in range(4):
        term.value_of_numbers({name: array.copy() for name, array in values.items()} | numbers(seed))
    assert len(asked) == 1
    term.value_of_numbers(velocities(1) | numbers(0))
    assert len(asked) == 2


@pytest.mark.parametrize("in_place", [False, True])
def test_arrays_that_look_alike_are_told_apart(kept, in_place):
    term, values = Compiled("curve", CURVE), velocities()
    term.value_of_numbers(values | numbers(0))
    turned = {name: array[::-1].copy() for name, array in values.items()}  # of the same sums
    if in_place:
        for name, array in values.items():
            array[:] = turned[name]
        turned = values
    np.testing.assert_array_equal(term.value_of_numbers(turned | numbers(0)), term.value(turned | numbers(0)))


def test_a_plain_number_in_the_place_of_an_array_is_no_part(kept):
    term, values = Compiled("two", "k * (w * abs(v))"), velocities()
    for v in (1.0, -3.0):
        np.testing.assert_array_equal(
            term.value_of_numbers({"k": 1.0, "w": values["w"], "v": v}), values["w"] * abs(v)
        )


def test_means_over_the_past_are_kept_by_what_they_are_of(kept):
    term, step = Compiled("late", "k * ago(0.1, 0.3)"), np.full((2, N // 2), 0.1)
    for seed in range(2):
        ago = Ago(velocities(seed)["v"], step)
        np.testing.assert_array_equal(term.value_of_numbers({"k": 2.0, "ago": ago}), 2.0 * ago(0.1, 0.3))


def test_what_is_kept_stays_within_its_limit(kept, monkeypatch):
    one = Compiled("curve", CURVE)
    one.value_of_numbers(velocities() | numbers(0))
    monkeypatch.setattr(formula_value, "KEPT_BYTES", 2 * kept._bytes)
    for seed in range(1, 6):
        one.value_of_numbers(velocities(seed) | numbers(0))
    assert len(kept._entries) == 2
    assert kept._bytes == sum(entry.bytes for entry in kept._entries.values())


def test_threads_may_ask_at_once(kept):
    term = Compiled("curve", CURVE)
    cases = [velocities(seed % 3) | numbers(seed) for seed in range(30)]
    with ThreadPoolExecutor(4) as threads:
        found = list(threads.map(term.value_of_numbers, cases))
    for values, value in zip(cases, found, strict=True):
        np.testing.assert_array_equal(value, term.value(values))


def test_a_term_is_pickled_as_its_text(kept):
    values = velocities() | numbers(0)
    term = Compiled("curve", CURVE)
    wanted = term.value_of_numbers(values)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(term)).value_of_numbers(values), wanted)



class _Waits:
    """Garbage that lets other threads run while it is collected."""

    def __init__(self):
        self.itself = self

    def __del__(self):
        time.sleep(1e-4)


def test_threads_may_make_formulas_at_the_same_time():
    """Python's parser fails in one thread when another goes on within its call, as while garbage is collected."""
    terms = [" + ".join(f"k{i} * abs(v) * (w + {i + n})" for i in range(20)) for n in range(40)]

    def made(term):
        _Waits()
        return Compiled("sum", term).names

    before = gc.get_threshold()
    gc.set_threshold(50, 5, 5)
    try:
        with ThreadPoolExecutor(4) as pool:
            assert all(len(names) == 22 for names in pool.map(made, terms * 4))
    finally:
        gc.set_threshold(*before)
