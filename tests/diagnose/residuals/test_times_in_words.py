"""A share of all speeds that changes within a trial, in words."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.residuals.places_in_words import time_in_trial

PREDICTOR = SimpleNamespace(tracks=SimpleNamespace(own_s=np.array([2.0, 8.0])))


@pytest.mark.parametrize(
    ("term", "said"),
    [
        ("0.0647 * (1 - tau/8)", "faster by 6.47% at 0 s of a trial than at 8 s"),
        ("-0.064 * tau/8", "slower by 6.40% at 8 s of a trial than at 0 s"),
        ("0.03 - 0.05 * tau/8", "slower by 2.00% at 8 s of a trial, faster by 3.00% at 0 s"),
        ("0.2 - 0.1 * tau/8", "faster by 10.00% at 8 s of a trial, faster by 20.00% at 0 s"),
    ],
)
def test_where_a_share_is_nothing_it_is_not_called_slower(term, said):
    assert time_in_trial(SimpleNamespace(term=term, values={}), PREDICTOR) == said
