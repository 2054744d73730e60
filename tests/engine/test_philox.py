"""Random numbers: known answers, the slow twin, and what a draw may depend on."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bns.engine import philox, reference
from bns.engine.philox import Key, Purpose, normals, uniforms, words

WORD = st.integers(0, 2**32 - 1)
ONES = 0xFFFFFFFF
KNOWN = [  # kat_vectors of the Random123 library, philox4x32-10
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((ONES,) * 4, (ONES, ONES), (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


def compiled(counter, key):
    c, k = [np.uint32(x) for x in counter], [np.uint32(x) for x in key]
    return tuple(int(x) for x in philox.philox(*c, *k))


@pytest.mark.parametrize(("counter", "key", "answer"), KNOWN)
def test_known_answers(counter, key, answer):
    assert reference.philox4x32_10(counter, key) == answer
    assert compiled(counter, key) == answer


@given(st.tuples(WORD, WORD, WORD, WORD), st.tuples(WORD, WORD))
def test_kernel_is_its_twin(counter, key):
    assert compiled(counter, key) == reference.philox4x32_10(counter, key)


def test_blocks_are_numbered_by_slot_individual_step_and_purpose():
    key, step = Key(11, 2**32 - 5), 7
    block = words(key, Purpose.MUTATION, step, 3, 4)
    assert block.shape == (3, 4, 4)
    for i in range(3):
        for j in range(4):
            assert tuple(block[i, j]) == reference.draw(key, Purpose.MUTATION, step, i, j)


def test_a_draw_does_not_depend_on_how_many_are_asked_for():
    key = Key(3, 9)
    few, many = (uniforms(key, Purpose.INITIAL_COMMAND, 5, n, m) for n, m in ((2, 3), (50, 20)))
    np.testing.assert_array_equal(few, many[:2, :3])


def one(seed=1, root_seed=0, robot="khepera", task="circle", purpose=Purpose.SPLIT, step=1):
    return uniforms(Key.of_run(seed, root_seed, robot, task), purpose, step, 4, 4)


def test_same_seed_same_numbers():
    np.testing.assert_array_equal(one(), one())


@pytest.mark.parametrize(
    "change", [{"seed": 2}, {"root_seed": 1}, {"robot": "snake"}, {"task": "infinity"}, {"purpose": 7}, {"step": 2}]
)
def test_whatever_names_a_draw_changes_all_of_it(change):
    assert not np.isin(one(**change), one()).any()


def test_no_two_purposes_share_their_numbers():
    assert list(Purpose.__members__.values()) == list(range(len(Purpose.__members__)))


def test_uniforms_fill_the_unit_interval_evenly():
    u = uniforms(Key(0, 0), Purpose.PROBE, 0, 50, 500).ravel()
    assert u.min() >= 0
    assert u.max() < 1
    counts = np.histogram(u, 20, (0, 1))[0]
    chi2 = ((counts - len(u) / 20) ** 2 / (len(u) / 20)).sum()
    assert chi2 < 43.8  # 19 degrees of freedom: one in a thousand goes beyond, and the draws are always these
    assert abs(np.corrcoef(u[:-1], u[1:])[0, 1]) < 4 / np.sqrt(len(u))


def test_normals_have_the_moments_of_a_normal_and_are_finite():
    z = normals(Key(0, 0), Purpose.PROBE, 0, 50, 500)
    assert np.isfinite(z).all()
    flat = z.ravel()
    error = 4 / np.sqrt(len(flat))
    moments = [flat.mean(), flat.var() - 1, (flat**3).mean(), (flat**4).mean() - 3]
    assert np.all(np.abs(moments) < np.array([1, 2**0.5, 15**0.5, 96**0.5]) * error)
    together = np.corrcoef(z.reshape(-1, 4).T) - np.eye(4)
    assert np.abs(together).max() < 4 / np.sqrt(len(flat) / 4)


def test_normals_are_box_and_mullers_of_the_words():
    key = Key(4, 2)
    a, b, c, d = ((w + 0.5) / 2**32 for w in reference.draw(key, Purpose.WORLD_EVALUATED, 3, 0, 1))
    r, s = np.sqrt(-2 * np.log(a)), np.sqrt(-2 * np.log(c))
    wanted = [
        r * np.cos(2 * np.pi * b),
        s * np.cos(2 * np.pi * d),
        r * np.sin(2 * np.pi * b),
        s * np.sin(2 * np.pi * d),
    ]
    np.testing.assert_allclose(normals(key, Purpose.WORLD_EVALUATED, 3, 1, 2)[0, 1], wanted, rtol=1e-12)
