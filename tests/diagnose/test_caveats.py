"""What a note advises follows from the errors at every horizon."""

from types import SimpleNamespace

import pytest

from bns.diagnose.caveats import _no_lower


@pytest.mark.parametrize(
    ("rose", "fell", "said"),
    [
        ((), (), "need not be added"),
        (("trial",), ("command", "1s"), "rises over the whole trial, though it falls over one command and 1 second"),
        (("5s", "trial"), (), "rises over 5 seconds and the whole trial: it describes the robot, and must not be added"),
    ],
)
def test_a_term_with_which_an_error_rises_must_not_be_added(rose, fell, said):
    assert said in _no_lower(SimpleNamespace(rose_at=rose, fell_at=fell))
