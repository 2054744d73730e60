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
    ways_apart: int = setting(
        3, "frames", "Ways that are compared lie so far apart, as `lags`: neighbours share errors of the camera."
    )
    moves_z: float = setting(
        2.0,
        "standard errors",
        "Ways are alike from here on. Tracking errors with a memory of 0.4 to 0.9 a frame (AR(1), up to 5 mm and 0.05 rad) stay "
        "below 0, over ways of 3 to 18 frames; a heading that swings by 0.02 rad in 1.5 s reaches 24.",
    )
    tracker_memory: float = setting(
        0.08,
        "correlation",
        "What the track moved in one frame is opposed by more than this three or more frames later: errors with a memory of r a "
        "frame (AR(1)) reach (1 - r) r^2 / 2, at most 0.074.",
    )
    clip: float = setting(
        4.0,
        "standard deviations",
        f"Whitened residuals are cut here, so that one mistaken marker decides nothing; {BY_HAND}.",
    )
    flexible_terms: int = setting(
        3,
        "terms",
        "Flexible terms put beside the effects at most: they have some ten numbers each, together half as many as trials.",
    )
    clearly_better: float = setting(
        0.0015,
        "1",
        "A free curve takes the place of a listed effect if it leaves less by this share of the loss (that of `least`) and by "
        "`min_z` standard errors: else the effect, which has fewer numbers and a name, is preferred.",
    )
    kept_share: float = setting(
        0.2,
        "1",
        "Beside flexible terms an accepted effect must earn this share of what it earns without them: motor-lag kept 8 % beside "
        "the term for play in gears, which it had imitated.",
    )
    kept_share_of_term: float = setting(
        0.1,
        "1",
        "And a term beside all accepted effects this share of what it earned when it came in: 25 % is the least that was kept by "
        "one that was right (play in gears beside the lag that imitates it), nothing by one that two effects explain.",
    )
    large: float = setting(
        0.02,
        "1",
        "A term that earns this share of the loss may be earned in fewer trials (`large_z`): a motor heats up in the first few "
        "trials of a session, and a patch of floor is crossed by a few.",
    )
    large_z: float = setting(
        1.5, "standard errors", "Of a term that is large: 1.65 and 1.8 for heating, 1.6 to 2.3 for patches of floor."
    )
    rounding_steps: tuple[int, int] = setting(
        (240, 41),
        "steps",
        "Steps of speed that are tried, then again around the best: speeds are then rounded right but for one in a hundred.",
    )
    whole_rounding: float = setting(
        0.2,
        "1",
        "Speeds come in steps if the rounding that is fitted is whole within this: 0.9995 where they do; 0.47 was fitted to a "
        "robot that drives few different speeds.",
    )
    rounding_range: tuple[float, float] = setting(
        (3.0, 40.0), "steps", f"Into so many parts the fastest speed is taken to be divided; {BY_HAND}."
    )
    speed_knots: tuple[float, ...] = setting(
        (0.0, 0.04, 0.1, 0.2, 0.35, 0.6, 1.0),
        "of the fastest speed",
        "Bends of a free curve along a wheel's own speed, closer where friction acts; it is nothing at rest.",
    )
    session_knots: tuple[float, ...] = setting(
        (0.0, 0.01, 0.03, 0.07, 0.15, 0.35, 0.65, 1.0),
        "of the session",
        f"Bends of a free curve along the session, closer where it begins: motors warm up within a few trials; {BY_HAND}.",
    )
    time_knots: tuple[float, ...] = setting(
        (0.0, 0.04, 0.1, 0.22, 0.45, 1.0),
        "of the longest trial",
        "Bends of a curve along the time in a trial, closer where it begins: what warms up or settles is fastest there; it is "
        "nothing at the last one.",
    )
    reversal_knots: tuple[float, ...] = setting(
        (0.0, 0.03, 0.08, 0.16, 0.4),
        "wheelbases",
        "Bends of a curve along a wheel's way since it changed direction: play in gears is a few hundredths of a wheelbase; "
        "it is nothing at the last one.",
    )
    response_knots_s: tuple[float, ...] = setting(
        (0.0, 0.04, 0.1, 0.18, 0.28, 0.4, 0.55, 0.75, 1.0, 1.35, 1.8, 2.5),
        "s",
        "Bends of a wheel's free response to a change of its command, closer where it is fresh: motors answer within tenths of a "
        f"second, what rings or winds up settles within two; {BY_HAND}.",
    )
    surface_knots: tuple[tuple[float, ...], tuple[float, ...]] = setting(
        ((0.0, 0.4, 1.0), (0.0, 0.3, 0.6, 1.0)),
        "of the highest speed, and of the sharpest turn",
        f"Knots of a free surface over both, as many as a formula may be long; {BY_HAND}. With them a robot that slides "
        "beyond a lateral acceleration is described.",
    )
    swing_knots: tuple[float, ...] = setting(
        (0.0, 0.1, 0.3, 0.6, 1.0),
        "1",
        "Bends of a curve along how far the motion's direction is from that of the last half wheelbase of way (1: reversed); "
        "it is nothing at the first one.",
    )
    floor_side: int = setting(
        4, "bumps", f"A field over the floor that is written down has so many bumps a side; {BY_HAND}."
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
    outlier_moved: float = setting(
        5.0,
        "standard deviations",
        "And only if the track alone moved so much farther from the prediction than in most windows. Of 3,399 windows of four "
        "generated logs with an autocorrelated tracker (0.7 to 0.97 a frame, 20 to 60 Hz) and a right model the largest was 3.9.",
    )
    outlier_trials: int = setting(
        3,
        "trials",
        "So many trials at least must have such a window: a robot that was kicked once tells nothing of its model.",
    )
    worst_share: float = setting(
        0.03, "1", f"So many trials at most may be set aside as unlike the rest, rounded up: more are a phenomenon; {BY_HAND}."
    )
    worst_far: float = setting(
        6.0,
        "standard deviations",
        "A trial stands out whose loss a frame (its logarithm) lies so far above the median of all: of 60 honest ones the worst "
        "reached 3.2 (8 worlds), trials with another wheelbase (by a quarter to two fifths) 9 to 20.",
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
    patch_side: int = setting(
        7, "places", f"A round patch of floor is first sought at so many places a side; {BY_HAND}."
    )
    patch_radii: tuple[float, ...] = setting(
        (0.06, 0.12, 0.2, 0.3), "of the floor's diagonal", f"Radii that a patch is first sought with; {BY_HAND}."
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
