"""What `bns.run` is given in Python: a world by its name or its file, never a model in memory."""

from pathlib import Path

import pytest

import bns
from bns.api.run import _named


@pytest.mark.parametrize(
    ("world", "said"),
    [
        (bns.Model("khepera").with_effect("motor-lag", tau_s=0.2), r"^world is the model khepera in memory.*model\.save\('mine"),
        (3, "^world is given as int; give a name"),
    ],
)
def test_a_world_that_is_no_name_is_told_how_to_be_given(world, said):
    with pytest.raises(bns.SpecError, match=said) as refused:
        bns.run(world=world)
    assert "a world that changes is written" not in str(refused.value)
    assert "world='physics>mine.yaml@50'" in str(refused.value)


def test_a_path_is_the_text_of_it():
    assert _named(Path("mine.yaml")) == "mine.yaml"
