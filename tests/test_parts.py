"""A long suite in parts: every test is in one of them, and stays there."""

import subprocess
import sys

import pytest

from tests.conftest import in_part

NAMES = [f"tests/test_some.py::test_{i}[{i % 7}]" for i in range(300)]


@pytest.mark.parametrize("of", [1, 2, 5])
def test_each_test_is_in_one_part(of):
    parts = [{name for name in NAMES if in_part(name, f"{which}/{of}")} for which in range(1, of + 1)]
    assert set().union(*parts) == set(NAMES)
    assert sum(map(len, parts)) == len(NAMES)
    assert min(map(len, parts)) > 0.6 * len(NAMES) / of


@pytest.mark.parametrize("part", ["0/2", "3/2"])
def test_a_part_that_is_not_there_is_named(part):
    with pytest.raises(pytest.UsageError, match=r"there are the parts 1/2 to 2/2"):
        in_part(NAMES[0], part)


def test_the_option_leaves_the_others_out():
    ask = [sys.executable, "-m", "pytest", "-q", "--collect-only", "-p", "no:cacheprovider", __file__]
    said = [
        subprocess.run([*ask, *more], capture_output=True, text=True, check=True).stdout.splitlines()
        for more in ([], ["--part", "1/2"], ["--part", "2/2"])
    ]
    seen = [{line for line in lines if "::" in line} for lines in said]
    assert seen[1] | seen[2] == seen[0]
    assert not seen[1] & seen[2]
    assert seen[1]
    assert seen[2]
