"""When two explanations cannot be told apart: what they lose on trials held out differs by luck alone, or by next to nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.significance import paired_elpd_diff

TIE_Z = 2.0
"""Two explanations whose held-out losses differ by fewer standard errors than this cannot be told apart ..."""
SIGNS_Z = 4.0
"""... unless nearly all trials are against one of them, by so many standard errors of a fair coin."""
TIE_SHARE = 0.001
"""Nor can those whose difference is a smaller share than this of what either earns: no model drives as exactly as that."""
TIE_LOSS = 3.0
"""Nor those that differ by less log-likelihood than this over all trials: odds of twenty to one. A spare number costs as much."""


def indistinguishable(tried: Fit, fit: Fit, without: Fit) -> bool:
    """Whether ``tried`` cannot be told from ``fit``, an explanation that both put in the place of nothing (``without``)."""
    worth = paired_elpd_diff(without.held_out, fit.held_out)[0]
    lost, se = paired_elpd_diff(tried.held_out, fit.held_out)
    certain = lost >= TIE_Z * se or _mostly_worse(tried, fit)
    return not (certain and bool(matters(np.array(lost), worth, len(fit.held_out))))


def matters(lost: Array, worth: float, trials: int) -> NDArray[np.bool_]:
    """Whether mean losses a trial are large enough to speak against an explanation, were they certain."""
    return np.asarray((lost >= TIE_SHARE * worth) & (lost * trials >= TIE_LOSS))


def _mostly_worse(tried: Fit, fit: Fit) -> bool:
    """Whether so many trials lose that it cannot be luck: a few wild ones that make the mean uncertain do not hide it."""
    trials = len(fit.held_out)
    worse = int((tried.held_out > fit.held_out).sum())
    return bool(2 * worse - trials > SIGNS_Z * np.sqrt(trials))
