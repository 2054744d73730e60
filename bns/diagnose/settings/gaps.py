"""Settings of gaps between poses: which of them are lost poses."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Gaps:
    """Lost poses in ``data/checks.py``."""

    usual_gaps: float = setting(
        0.95,
        "1",
        "Of the gaps between poses that follow each other row by row, so that none is lost between them, this fraction is no "
        "longer than usual. Poses are lost where rows without one lie in a gap that is nearer to two such gaps than to one. With "
        "the median, a tracker whose frames come every 33 to 100 ms seemed to lose 16 to 26 poses of 130 where about 4 were "
        "lost (another author's log), now 14 at most; the rest of 5 % leaves room for rows that were not written.",
    )
    gaps_by_chance: float = setting(
        0.01,
        "gaps a trial",
        "Where frames come at uneven times, a gap is no lost pose if, by what is seen of shorter ones, more than so many in a "
        "trial are as long by chance. Of 40 simulated trials with gaps of a gamma distribution (12 ms and more, usually 24), a "
        "command every 0.1 s and no pose lost, all seemed to lose some by the length of usual gaps alone, now 0 to 7. Of single "
        "lost poses of an even tracker all are found with stamps that jitter by 5 % of a frame, 75 % with 10 %.",
    )
    gaps_typical: float = setting(
        0.75,
        "1",
        "Gaps in which no row lies show how long gaps may be, unless their median is below this fraction of that of all gaps: "
        f"then rows of commands come too often to leave usual gaps whole; {BY_HAND}.",
    )
