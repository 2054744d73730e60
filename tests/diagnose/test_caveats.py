"""What a note advises follows from the errors at every horizon."""

from types import SimpleNamespace

import pytest

from bns.diagnose.caveats import _no_lower
from bns.diagnose.predict.paired_errors import Change, PairedErrors


@pytest.mark.parametrize(
    ("rose", "fell", "said"),
    [
        ((), (), "is not needed in the model"),
        (("trial",), ("command", "1s"), "rises over the whole trial, though it falls over one command and 1 second"),
        (("5s", "trial"), (), "rises over 5 seconds and the whole trial. It describes the robot, but do not add it"),
    ],
)
def test_a_term_with_which_an_error_rises_must_not_be_added(rose, fell, said):
    assert said in _no_lower(SimpleNamespace(rose_at=rose, fell_at=fell))


def test_an_error_that_may_have_changed_by_luck_neither_fell_nor_rose():
    changes = {"command": Change(-0.01, -0.02, -0.005), "1s": Change(-0.01, -0.02, 0.01), "trial": Change(0.1, 0.05, 0.2)}
    errors = PairedErrors({h: SimpleNamespace(total=change) for h, change in changes.items()}, None, 20)
    assert (errors.fell_at, errors.rose_at) == (("command",), ("trial",))
