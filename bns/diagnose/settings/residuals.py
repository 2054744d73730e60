"""Settings of what is left when the effects are fitted, and of why networks are wrong."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Residuals:
    """``residuals/``: curves and fields, repetition along time, moments that stand out, formulas, errors of networks."""

    knots: int = setting(5, "quantiles", f"Bends of a free curve: at these many quantiles of the variable; {BY_HAND}.")
    field_bumps: int = setting(5, "bumps", f"A field over the floor has so many bumps a side; {BY_HAND}.")
    penalties: tuple[float, ...] = setting(
        (1.0, 30.0),
        "1",
        "How strongly curves are drawn to zero, in expected squares of the standardised curve; the better one counts; "
        f"{BY_HAND}.",
    )
    chance: float = setting(0.02, "1", f"Chance of any false alarm over all variables and channels; {BY_HAND}.")
    least: float = setting(
        0.0015,
        "1",
        "Least gain that counts, as a share of the loss. Raised in development above what motors with lag leave when the lag is "
        "fitted.",
    )
    lags: tuple[int, ...] = setting(
        (3, 5, 8, 12, 18), "frames", "Not shorter: neighbours share errors of the camera and of its clock."
    )
    least_alike: float = setting(
        0.06,
        "correlation",
        "Inside commands honest robots reach +0.04, for a jitter of the motors of 0.2 to 4 %.",
    )
    least_opposed: float = setting(
        0.10,
        "correlation",
        "They reach -0.07 too: the filter takes what stays the same through a command for steps at random, and "
        "corrects too much.",
    )
    least_between: float = setting(
        0.33, "correlation", "From one command to the next they reach +0.32: a robot whose clock is 0.12 s late."
    )
    correlation_z: float = setting(
        4.5,
        "standard errors",
        f"Less certain correlations are those of honest robots as well; the number is {BY_HAND}.",
    )
    clip: float = setting(
        4.0,
        "standard deviations",
        f"Whitened residuals are cut here, so that one mistaken marker decides nothing; {BY_HAND}.",
    )
    flexible_terms: int = setting(
        2,
        "terms",
        "Flexible terms put beside the effects at most, each along another variable: two fields have 50 numbers, as "
        "many as trials.",
    )
    majority_chance: float = setting(
        0.05,
        "1",
        "An effect that acts everywhere helps more than half of the trials; by luck alone so many are helped with this chance: "
        "the usual level.",
    )
    outlier_frames: int = setting(
        12,
        "frames",
        "A window of about half a second at camera rate. What a marker does for a single frame hardly counts in it.",
    )
    outlier_far: float = setting(
        6.0,
        "standard deviations",
        f"A window stands out that is so many times as far off as most are (by the median); {BY_HAND}.",
    )
    outlier_trials: int = setting(
        3,
        "trials",
        "So many trials at least must have such a window: a robot that was kicked once tells nothing of its model.",
    )
    fault_jump: float = setting(
        20.0,
        "standard deviations",
        "A position off by more within a frame, and by `fault_ways`, is a mistaken marker, and what lies within `outlier_frames` "
        f"of it says nothing of the robot; {BY_HAND}.",
    )
    fault_ways: float = setting(
        3.0, "1", "And by more than three times the way of the wheels: no robot does this within a frame."
    )
    fault_turn: float = setting(
        100.0, "standard deviations", f"A heading off by more within a frame is a mistaken marker; {BY_HAND}."
    )
    formula_terms: int = setting(
        3, "terms", f"Terms of a formula at most: it should be short enough to be read; {BY_HAND}."
    )
    input_least: float = setting(
        0.02, "1", f"Least share of the squared error that a variable must explain to be named; {BY_HAND}."
    )
    input_most: int = setting(
        3,
        "variables",
        "As many variables are named, one after the other; what comes later is mostly the first in other clothes.",
    )
    input_ridge: float = setting(1.0, "1", f"Pull of curves towards zero, in commands of typical size; {BY_HAND}.")
    neighbours: int = setting(
        3,
        "patterns",
        "How near the data are is the mean distance to so many training patterns, in inputs that run from -1 to 1; "
        f"{BY_HAND}.",
    )
    usual_share: float = setting(
        0.95,
        "1",
        "Among the patterns are commands that lie as near to them as this share of the patterns do to one another; "
        f"{BY_HAND}.",
    )
    fewest_commands: int = setting(30, "commands", f"Of fewer commands among the patterns nothing is said; {BY_HAND}.")
    fewest_trials: int = setting(6, "trials", f"Nor of commands from fewer trials: folds need some in each; {BY_HAND}.")
    sparse_draws: int = setting(
        1000,
        "samples",
        "Bootstrap samples over trials: the ends of a 95 % interval are then known to 10 % of its width.",
    )
    sparse_least: float = setting(
        0.1, "1", f"Least share of the squared error for which thin data are named; {BY_HAND}."
    )
    sparse_chance: float = setting(
        0.01,
        "1",
        f"What inputs tell of the errors is taken off where luck would give it with less than this chance; {BY_HAND}.",
    )
    memory_s: float = setting(0.5, "s", "Time constant of the memory that is looked for: that of slow motors.")
