"""What the command line answers has not changed, to the last digit; and a digit that has is found."""

import copy
import json
import re
from pathlib import Path

import pytest

from tests import digests
from tests.digests_kept import QUICK, kept

FILE = Path(__file__).with_name("digests-quick.json")
EVALS = "sweep quick-khepera: evals"
pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]  # where the kernels must be compiled and the machine has much to do


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return kept(QUICK, tmp_path_factory.mktemp("digests"))


@pytest.fixture
def written(found):
    return json.loads(digests.text_of(digests.written_of(found)))


def with_number(items, name, column, change):
    changed = copy.deepcopy(items)
    changed[name][column][0] = repr(float(changed[name][column][0]) * change)
    return changed


def test_a_small_set_answers_as_it_did(found, capsys):
    assert digests.check(json.loads(FILE.read_text()), found) == 0, capsys.readouterr().out


def test_a_last_digit_is_shown_with_its_place(found, written, capsys):
    assert digests.check(written, with_number(found, EVALS, "fitness_world", 1 + 1e-14)) == 1
    assert re.search(rf"{EVALS}: fitness_world\[0\] was [\d.]+, is [\d.]+\n", capsys.readouterr().out)


def test_the_thirteenth_digit_of_a_diagnosis_may_differ_and_the_eighth_may_not(found, written, capsys):
    name, column = "world tie-far-tether", "error command"
    assert digests.check(written, with_number(found, name, column, 1 + 2e-13)) == 0
    assert digests.check(written, with_number(found, name, column, 1 + 2e-8)) == 1
    assert f"{name}: {column}[0] was" in capsys.readouterr().out


def test_another_processor_may_differ_in_last_digits_and_no_more(found, written, capsys):
    written["machine"]["processor"] = "another"
    assert digests.check(written, with_number(found, EVALS, "fitness_world", 1 + 1e-4)) == 0
    assert "another kind of machine (processor)" in capsys.readouterr().out
    assert digests.check(written, with_number(found, EVALS, "fitness_world", 1 + 1e-2)) == 1
    found = found | {"world tie-far-tether": found["world tie-far-tether"] | {"verdict": ["none"]}}
    assert digests.check(written, found) == 1
    assert "world tie-far-tether: verdict[0] was tie, is none" in capsys.readouterr().out


def test_what_is_new_is_told_and_what_is_gone_is_missed(found, written, capsys):
    more = found | {"figure new": {"a": ["1"]}, EVALS: found[EVALS] | {"new": ["1"]}}
    assert digests.check(written, more) == 0
    assert "new, and not compared: figure new" in capsys.readouterr().out
    less = {name: item for name, item in more.items() if name != EVALS}
    assert digests.check(written, less) == 1
    assert f"{EVALS}: is there no more" in capsys.readouterr().out
