"""Settings of the times at which single commands take effect."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class CommandTimes:
    """``residuals/command_times.py`` and ``residuals/delays_follow.py``."""

    command_shift_s: float = setting(
        0.01, "s", f"How far each change of command is shifted, to see along which direction the poses answer; {BY_HAND}."
    )
    command_shifts: tuple[float, int, int] = setting(
        (0.2, 21, 3),
        "s, number, number",
        "Where the times of commands scatter, each is shifted by up to the first number either way, in so many steps, to find "
        f"when it took effect; the steps around the best are then halved, as often as the last number says; {BY_HAND}.",
    )
    command_window_s: float = setting(
        0.6,
        "s",
        f"Poses up to this long after a change of command say when it took effect, and as many later ones serve for comparison; "
        f"{BY_HAND}.",
    )
    command_well_known: float = setting(
        0.75,
        "of the changes",
        "The delays of single commands are judged where they are known best: small changes of speed say little of when they "
        f"happened; {BY_HAND}.",
    )
    command_fewest: int = setting(30, "changes", f"Fewest changes of command from which a scatter is concluded; {BY_HAND}.")
    command_times_usual: float = setting(
        6.0,
        "1",
        "Variance of the commands' delays, over what the same direction shows later in the commands, from which their scatter is "
        "certain. Logs of simulated robots with other faults have at most 3, with commands that are polled or lost 12 to 20.",
    )
    command_sizes_alike: tuple[tuple[float, ...], float] = setting(
        ((0.33, 0.5, 0.67, 0.8), 0.4),
        "of the changes, 1",
        "Commands scatter where the variance of the delays (s2) of the smaller changes is at least the second number times that "
        "of the larger ones, wherever the two are parted: each number of the first list is a share of smaller changes. Motors "
        "that were cut for 0.2 s after a large step (another author's simulator, two logs) left 0.12 and 0.18, commands late by "
        "chance 0.6 to 1.4 (seven simulated logs).",
    )
    delays_explained: float = setting(
        0.5,
        "of the variance",
        "Delays of single commands that a straight line along the place, the heading, a speed, the time or a logged column "
        "explains to so large a part follow that variable. Of delays at random, no more than 0.05 was explained in twelve "
        "logs of 240 commands; of 23, the fewest, 0.45 in 1 % of draws. Of those that a camera made which reads row by row, 0.94 "
        "and 0.87.",
    )
    delays_simpler: float = setting(
        0.05,
        "of the variance",
        "A variable with two numbers (the place in both directions, the heading), or one that is asked later, must explain so "
        f"much more of the delays than a simpler one that explains enough; {BY_HAND}.",
    )
    delays_far: float = setting(
        4.0,
        "standard deviations",
        "Delays that lie farther from their median than this many robust standard deviations count as if they lay there: one of "
        "379 that was measured 110 ms off made a quarter of their variance. Delays that are spread evenly reach 1.3.",
    )
