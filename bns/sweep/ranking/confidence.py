"""How sure a ranking is that was cut short: confidence that holds however often one has looked before."""

from __future__ import annotations

import numpy as np

from bns.sweep.ranking.betting import capital
from bns.sweep.ranking.race import Aim, Results

_SLACK = 1e-9


def confidences(results: Results, best: list[int], aim: Aim) -> list[float]:
    """Confidence, 0 to 1, that each of ``best`` (whole, best first) is among the ``top`` of the complete sweep, or within.

    The r-th is not only if top - r + 1 or more of the combinations that are left end above it (level with it or above,
    if ``within`` is 0). Some of the true best are among those, and the chance that one of so many as ``top`` has a
    capital of c is top / c at most: so all of the confidences hold together.
    """
    low, high = results.bounds()
    seeds, found = results.success.shape[1], []
    for rank, combination in enumerate(best, 1):
        target = float(low[combination]) + aim.within
        rivals = np.nonzero(~results.whole & (high >= target - _SLACK))[0]
        places = aim.top - rank + 1
        if len(rivals) < places:
            found.append(1.0)
            continue
        won = np.sort(capital(results.hopeful[rivals], results.seen[rivals], target * seeds))
        found.append(max(0.0, 1.0 - aim.top / float(won[places - 1])))
    return found
