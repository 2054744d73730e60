"""When two explanations cannot be told apart: what they lose on trials held out differs by luck alone, or by next to nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.significance import paired_elpd_diff
from bns.diagnose.settings import DEFAULTS

TIE_Z = DEFAULTS.select.tie_z
SIGNS_Z = DEFAULTS.select.tie_signs_z
TIE_SHARE = DEFAULTS.select.tie_share
TIE_LOSS = DEFAULTS.select.tie_loss


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
