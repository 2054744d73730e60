"""The table of effects, each added alone: the best ones, and all that the verdict names."""

from types import SimpleNamespace

import pytest

from bns.diagnose.report.text import _SHOWN, _ranking


def candidate(name, gain, why=""):
    earned = SimpleNamespace(elpd_diff=gain, dse=0.1, p_value=5e-5)
    return SimpleNamespace(name=name, rejected_because=why, paired_comparison=earned)


def lines(effects):
    ranking = [candidate(f"e{i}", 20.0 - i, "it is at a bound" if i == _SHOWN + 1 else "") for i in range(_SHOWN + 4)]
    step = SimpleNamespace(ranking=ranking, decoy_threshold=0.0)
    return list(_ranking(SimpleNamespace(selection=SimpleNamespace(steps=[step]), effects=effects)))


@pytest.mark.parametrize(("effects", "more"), [((), []), (("e0",), []), ((f"e{_SHOWN + 2}", "e1"), [f"e{_SHOWN + 2}"])])
def test_what_the_verdict_names_is_in_the_table_however_little_it_gains_alone(effects, more):
    named = [line.split()[0] for line in lines(effects) if line.startswith("  e")][1:]  # the first is the head
    assert named == [f"e{i}" for i in range(_SHOWN)] + more


def test_a_rejection_in_the_table_is_explained_below_it():
    def is_explained(effects):
        return any("(not considered: alone, it fits only with a number" in line for line in lines(effects))

    assert is_explained((f"e{_SHOWN + 1}",))
    assert not is_explained(())


def test_what_was_found_later_is_said_below():
    assert any("(not tried alone, but found later in the search: f)" in line for line in lines(("e1", "f")))
