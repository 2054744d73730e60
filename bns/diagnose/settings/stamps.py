"""Settings of time stamps that scatter; a part of those of the data."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Stamps:
    """``data/stamps.py``."""

    stamp_around: int = setting(
        5,
        "intervals",
        "The interval between two poses is compared with the mean of it and so many before and after it: the speed hardly "
        f"changes within, and a stamp's error counts a tenth; {BY_HAND}.",
    )
    stamp_gap: float = setting(
        4.0, "median intervals", f"After a longer interval the robot may drive otherwise: it is not compared; {BY_HAND}."
    )
    stamp_block: int = setting(
        50,
        "intervals",
        f"Blocks of neighbours for the standard error: noise and speed are correlated over fewer; {BY_HAND}.",
    )
    stamp_fewest: int = setting(200, "poses", f"Fewest poses from which a scatter of their stamps is concluded; {BY_HAND}.")
    stamp_z: float = setting(
        5.0,
        "standard errors",
        "From here on the variance of the stamps' errors is certain. Three generated logs whose stamps are off by 5 to 30 ms "
        "reached 21 to 32; logs of even, lost, uneven or interleaved poses with right stamps at most 3.",
    )
    stamp_real: float = setting(
        0.5,
        "1",
        "If the way driven follows more of the variance of the intervals than this, most of it is real, and nothing is "
        "said of stamps. Stamps off by 5 ms or more left at most 0.28, right stamps with a jitter of 1 ms at least 0.8.",
    )
    stamp_clock: float = setting(
        4.0,
        "1",
        "A tracker has a clock if its stamps agree with the best rate so many times as well as with the median rate. Arrival "
        "after an exponential delay of 0.75 periods reached 4.5, of 0.4 periods 11; uneven poses at most 2.6, poses taken after "
        "each centimetre 3.5.",
    )
    stamp_rates: tuple[float, float] = setting(
        (0.1, 0.125),
        "of the usual rate, rounds",
        "The rate of the tracker is searched for so far to either side of the usual one, in steps that change by the second "
        f"number of rounds over a trial; {BY_HAND}.",
    )
    stamp_pieces: tuple[int, int] = setting(
        (1000, 60), "poses, pieces", f"For it, trials are cut into pieces; so many are enough; {BY_HAND}."
    )
    stamp_steps: tuple[int, float, float] = setting(
        (50, 0.2, 0.1),
        "steps, steps, 1",
        "Stamps are rounded, or those of a logger that keeps poses until its next row, where intervals are multiples of a step: "
        "the usual one divided by at most the first number, within the second one (root mean square; 0.29 where they are not), "
        f"and more than the third share of them no multiples of the usual interval; {BY_HAND}.",
    )
