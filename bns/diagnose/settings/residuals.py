"""Settings of what is left when the effects are fitted, and of why networks are wrong."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.command_times import CommandTimes
from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Residuals(CommandTimes):
    """``residuals/``: curves and fields, autocorrelation, moments that stand out, formulas, errors of networks."""

    knots: int = setting(
        5, "quantiles", f"Knots of a free curve, at evenly spaced quantiles of the variable; {BY_HAND}."
    )
    field_bumps: int = setting(5, "bumps", f"Basis functions per side of a field over the floor; {BY_HAND}.")
    penalties: tuple[float, ...] = setting(
        (1.0, 30.0),
        "trials",
        "How strongly a curve is shrunk towards zero: as if so many typical trials said that it is zero. Both are tried, "
        f"and the one that predicts held-out trials better is used; {BY_HAND}.",
    )
    chance: float = setting(0.02, "1", f"Probability of any false alarm over all variables and channels; {BY_HAND}.")
    least: float = setting(
        0.0015,
        "1",
        "Least gain that counts, as a fraction of the loss. It was raised during development above what remains of "
        "a motor lag after the lag is fitted.",
    )
    lags: tuple[int, ...] = setting(
        (3, 5, 8, 12, 18),
        "frames",
        "No shorter lags, because neighbouring frames share errors of the camera and of its clock.",
    )
    line_z: float = setting(
        6.0,
        "standard errors",
        "Lines on the floor count from here on. On 121 logs without lines, with nothing of their effects in the model, the "
        "largest value over 180 directions is 4.8; 4 mm lost at each joint of tiles of 0.3 m make 13, 6 mm at five seams 12.",
    )
    line_step_deg: float = setting(
        1.0, "°", "Step of the directions of such lines. Over a floor's extent it is as far as a strip is wide, or less."
    )
    line_strip_m: float = setting(0.04, "m", f"Width of the strips at least, at first; {BY_HAND}.")
    line_wider: int = setting(8, "strips", f"What is common to so many neighbouring strips is no line; {BY_HAND}.")
    line_groups: int = setting(
        30, "parts", "Parts of the log, with as many frames each, that are compared: each two give a product."
    )
    line_frames: int = setting(20, "frames", f"Lines are not looked for where a part has fewer; {BY_HAND}.")
    line_levels: int = setting(
        3,
        "levels",
        f"Commands are alike if the wheels have the same of so many levels of speed, mirrored or reversed or not; {BY_HAND}.",
    )
    line_apart_deg: float = setting(30.0, "°", f"A second direction of lines differs at least so much; {BY_HAND}.")
    line_seen_z: float = setting(4.5, "standard errors", "A single line is told from here on, as `correlation_z`.")
    line_even: float = setting(0.12, "1", f"Lines are evenly spaced if none is off by more of the spacing; {BY_HAND}.")
    line_finer: int = setting(3, "times", "How often step and width are halved about the surest direction.")
    line_straight_deg: float = setting(
        2.0, "°", "Lines whose direction differs from a coordinate's by less are said to be at values of it."
    )
    line_strip_frames: int = setting(4, "frames", f"A strip with fewer tells nothing; {BY_HAND}.")
    line_most: int = setting(4, "directions", "Of lines in more directions than so many the surest are told.")
    line_shown: int = setting(6, "lines", "Most lines that are listed in a sentence.")
    least_alike: float = setting(
        0.06,
        "correlation",
        "Least positive autocorrelation within a command that counts: robots without a missing effect reach +0.04, for "
        "a jitter of the motors of 0.2 to 4 %.",
    )
    correlated_frames: int = setting(
        6,
        "frames",
        f"A correlation is read where so many frames have another one that much later; {BY_HAND}. Where most commands are too "
        "short for it at the shortest of `lags`, pieces twice as long as `longest_period_frames` take their place: "
        "eight robots that are steered so, with the right model, reach +0.02 and -0.09, a heading that swings by 0.8 Hz +0.35.",
    )
    least_opposed: float = setting(
        0.10,
        "correlation",
        "The same for negative autocorrelation within a command: robots without a missing effect reach -0.07, because the "
        "filter takes an error that is constant during a command for random steps, and corrects too much.",
    )
    least_between: float = setting(
        0.33,
        "correlation",
        "The same from one command to the next: +0.32 was reached by a robot whose clock is 0.12 s late.",
    )
    correlation_z: float = setting(
        4.5,
        "standard errors",
        f"Less certain correlations also occur in robots without a missing effect; the number is {BY_HAND}.",
    )
    ways_apart: int = setting(
        3,
        "frames",
        "Displacements that are compared are at least this far apart, as in `lags`: neighbouring frames share "
        "errors of the camera.",
    )
    longest_period_frames: int = setting(
        50,
        "frames",
        f"An oscillation is looked for up to this period, 2 s at 25 Hz: few commands last much longer; {BY_HAND}.",
    )
    moves_z: float = setting(
        2.0,
        "standard errors",
        "Displacements count as correlated from this value on. With autocorrelated tracking errors (0.4 to 0.9 per frame, "
        "AR(1), up to 5 mm and 0.05 rad) it stays below 0, over 3 to 18 frames; with a heading that oscillates by 0.02 rad "
        "in 1.5 s it reaches 24.",
    )
    tracker_memory: float = setting(
        0.08,
        "correlation",
        "A tracker is taken to have autocorrelated errors if what the track moved in one frame is reversed by more "
        "than this three or more frames later: errors with an autocorrelation of r per frame (AR(1)) reach (1 - r) "
        "r^2 / 2, at most 0.074.",
    )
    clip: float = setting(
        4.0,
        "standard deviations",
        f"Whitened residuals are clipped here, so that one mistaken marker does not decide; {BY_HAND}.",
    )
    flexible_terms: int = setting(
        3,
        "terms",
        "Largest number of flexible terms in addition to the effects: each has about ten parameters, so that three have "
        "half as many as a log of 60 trials has trials.",
    )
    clearly_better: float = setting(
        0.0015,
        "1",
        "A free curve replaces a listed effect if its loss is lower by this fraction (that of `least`) and by "
        "`min_z` standard errors. Otherwise the effect is preferred: it has fewer parameters and a name.",
    )
    kept_share: float = setting(
        0.2,
        "1",
        "Together with flexible terms, an accepted effect must keep this fraction of its gain without them: "
        "motor-lag kept 8 % when the term for backlash, which it had imitated, was added.",
    )
    kept_share_of_term: float = setting(
        0.1,
        "1",
        "Together with all accepted effects, a term must keep this fraction of the gain that it had when it was "
        "added. The least that a right term kept is 25 % (backlash, with the lag that imitates it); a term that "
        "two effects explain kept nothing.",
    )
    spanned_share: float = setting(
        0.9,
        "1",
        "If one effect that was lost to a term gains this fraction of what the term gains, in likelihood and in metres at "
        "every horizon at which the term predicts better for certain, the effect stands: a curve that can draw an effect leaves "
        "nothing for it to gain. True effects in simulated robots whose wheels slip gained 0.95 to 1 of the fall in metres; a "
        "dead zone in another author's robot, 0.73 of a fall of 6 micrometres over one command, and 0.91 in likelihood; effects "
        "that imitated something unlisted at most 0.8 (speed-gain for a motor that heats up; six generated worlds).",
    )
    slight_excess: float = setting(
        1.0,
        "of the tracking noise",
        "What is left is slight if, at every horizon, it adds less to the error than tracking noise does (root sum of squares): "
        "less than the tracker itself can show. Robots with contact physics whose speed controllers need 12 ms: at most 0.88. "
        "Unlisted effects in 31 generated worlds: at least 1.04 over one command, 2 over whole trials.",
    )
    large: float = setting(
        0.02,
        "1",
        "A term that gains this fraction of the loss may gain it in fewer trials (`large_z`): a motor heats up in "
        "the first few trials of a session, and a patch of floor is crossed by a few.",
    )
    large_z: float = setting(
        1.5, "standard errors", "For a large term: heating reached 1.65 and 1.8, patches of floor 1.6 to 2.3."
    )
    rounding_steps: tuple[int, int] = setting(
        (240, 41),
        "steps",
        "Numbers of step sizes of the speed that are tried: first over the whole range, then around the best. All but one "
        "in a hundred speeds are then rounded correctly.",
    )
    whole_rounding: float = setting(
        0.2,
        "1",
        "Speeds come in steps if the fitted rounding is within this of a whole number: 0.9995 where they do; 0.47 "
        "was fitted to a robot that drives few different speeds.",
    )
    rounding_range: tuple[float, float] = setting(
        (3.0, 40.0), "steps", f"Range of the number of steps into which the highest speed may be divided; {BY_HAND}."
    )
    speed_knots: tuple[float, ...] = setting(
        (0.0, 0.04, 0.1, 0.2, 0.35, 0.55, 0.75, 1.0),
        "of the fastest speed",
        "Knots of a free curve along a wheel's own speed, denser at low speed, where friction acts; the curve is "
        "zero at rest. With one knot fewer at high speed a driver's exponential curve of 15 % was off by 1.8 % at full speed.",
    )
    session_knots: tuple[float, ...] = setting(
        (0.0, 0.01, 0.03, 0.07, 0.15, 0.35, 0.65, 1.0),
        "of the session",
        "Knots of a free curve along the session, denser at its beginning: motors warm up within a few trials; "
        f"{BY_HAND}.",
    )
    session_change_knots: tuple[float, ...] = setting(
        (0.0, 0.25, 0.5, 0.75, 1.0),
        "of the session",
        "Knots of a free curve of what has changed since the session began, of each wheel and of turns: a load is moved at any "
        f"time; it is nothing at the first; {BY_HAND}.",
    )
    time_knots: tuple[float, ...] = setting(
        (0.0, 0.04, 0.1, 0.22, 0.45, 1.0),
        "of the longest trial",
        "Knots of a curve along the time in a trial, denser at its beginning, where warming up and settling are "
        "fastest; the curve is zero at the last knot.",
    )
    reversal_knots: tuple[float, ...] = setting(
        (0.0, 0.03, 0.08, 0.16, 0.4),
        "wheelbases",
        "Knots of a curve along a wheel's distance since it changed direction: play in gears is a few hundredths of "
        "a wheelbase; the curve is zero at the last knot.",
    )
    response_knots_s: tuple[float, ...] = setting(
        (0.0, 0.04, 0.1, 0.18, 0.28, 0.4, 0.55, 0.75, 1.0, 1.35, 1.8, 2.5),
        "s",
        "Knots of a wheel's free response to a change of its command, denser just after the change: motors respond within "
        f"tenths of a second; oscillation and integral wind-up settle within two seconds; {BY_HAND}.",
    )
    surface_knots: tuple[tuple[float, ...], tuple[float, ...]] = setting(
        ((0.0, 0.4, 1.0), (0.0, 0.3, 0.6, 1.0)),
        "of the highest speed, and of the sharpest turn",
        f"Knots of a free surface over speed and turn rate, as many as the length of a formula allows; {BY_HAND}. "
        "With them a robot that slides beyond a lateral acceleration is described.",
    )
    surface_driven: float = setting(
        0.02,
        "of the time",
        "A knot of such a surface has a number of its own only if the robot drove nearest to it for so long. There are twelve: "
        "with equal times each has 8 %. Where every knot had one, a skid-steer's term raised the error on other drives from 83 "
        "to 2673 mm (two knots had never been near any drive, two had 1 % of the time).",
    )
    swing_knots: tuple[float, ...] = setting(
        (0.0, 0.1, 0.3, 0.6, 1.0),
        "1",
        "Knots of a curve along the difference between the direction of motion and that over the last half "
        "wheelbase of distance (1: reversed); the curve is zero at the first knot.",
    )
    column_knots: tuple[float, ...] = setting(
        (0.0, 0.5, 1.0),
        "quantiles",
        "Knots of a free curve along a further column of the log, as quantiles of the values that occur: beside a straight line "
        f"one bend; {BY_HAND}.",
    )
    straight_within: tuple[float, float] = setting(
        (0.001, 0.1),
        "of the sharpest turn",
        "Commands whose turn is at most the first share are straight lines. A term for what happens on them alone fades out from "
        f"none to the second share, because wheels that differ a little turn the robot a little; {BY_HAND}.",
    )
    straight_share: float = setting(
        0.05,
        "of the steps",
        "Such a term is tried where at least this share of the driven steps are straight lines, and as many are turns; "
        f"{BY_HAND}.",
    )
    floor_side: int = setting(
        4, "bumps", f"Basis functions per side of a field over the floor that is written as a formula; {BY_HAND}."
    )
    outlier_frames: int = setting(
        12,
        "frames",
        "Length of a window: about half a second at camera rate. The error of a marker in a single frame hardly "
        "counts in it.",
    )
    outlier_far: float = setting(
        6.0,
        "standard deviations",
        f"A window stands out if its error is this many robust standard deviations of all windows' errors; {BY_HAND}.",
    )
    outlier_moved: float = setting(
        5.0,
        "standard deviations",
        "By the track alone, without the filter, the window must also depart from the prediction by this many times the "
        "usual distance. Of 3,399 windows of four generated logs with an autocorrelated tracker (0.7 to 0.97 per frame, "
        "20 to 60 Hz) and "
        "a right model, the largest value was 3.9.",
    )
    outlier_alone: float = setting(
        1 / 3,
        "1",
        "In a moment that stands out one wheel alone is said not to turn as predicted if the other one is off by less than this "
        f"share of what it is off by; {BY_HAND}.",
    )
    outlier_still: float = setting(
        0.2,
        "1",
        "In a moment that stands out the robot is said to have stood still if it moved by less than this fraction of what was "
        f"predicted; {BY_HAND}.",
    )
    outlier_late: float = setting(
        0.5,
        "1",
        "It is said to have done what it had been told shortly before if what is predicted of a window up to as many frames "
        f"earlier is off by less than this fraction of the model's error; {BY_HAND}.",
    )
    outlier_mostly: float = setting(
        2 / 3,
        "1",
        f"Either is said where it is so in at least this fraction of the moments, the worst of each trial; {BY_HAND}.",
    )
    outlier_trials: int = setting(
        3,
        "trials",
        "At least this many trials must have such a window: a single push against the robot says nothing of its "
        "model.",
    )
    share_fewest: int = setting(
        8,
        "changes",
        "So many changes of command at least must be followed by a moment that stands out, and so many by none, before the tool "
        "says what the first ones share, and so many trials must have such a moment before it says where these begin: fewer "
        "could share one of many properties by chance.",
    )
    share_pure: float = setting(
        0.8,
        "1",
        "At least this fraction of the changes of command beyond the limit must be followed by such a moment, and at least this "
        "fraction of such moments must follow one beyond it. Two robots of another hand whose motors stop for 0.2 s after large "
        "steps had 0.90 and 0.88; of robots of that hand with a lag, a delay, a limit of speed, a marker that sways, steps that "
        "are ignored and motors that tire, asked without these effects, the largest was 0.77. With an acceleration limit it was "
        "0.87: large steps are what it acts on. Of moments that share a place, at least this fraction must begin there.",
    )
    worst_share: float = setting(
        0.03,
        "1",
        "Largest fraction of trials, rounded up, that may be excluded as outliers: a larger fraction is a property of the "
        f"robot; {BY_HAND}.",
    )
    worst_far: float = setting(
        6.0,
        "standard deviations",
        "A trial stands out if the logarithm of its loss per frame lies this far above the median: of 60 trials of "
        "robots without a missing effect the worst reached 3.2 (8 worlds), trials with another wheelbase (by a "
        "quarter to two fifths) 9 to 20.",
    )
    fault_jump: float = setting(
        20.0,
        "standard deviations",
        "A position that is off by more within one frame, and by `fault_ways`, is a mistaken marker; all within "
        f"`outlier_frames` of it is ignored; {BY_HAND}.",
    )
    fault_ways: float = setting(
        3.0,
        "1",
        "It must also be off by more than this many times the distance that the wheels drove: no robot does this "
        "within a frame.",
    )
    fault_turn: float = setting(
        100.0, "standard deviations", f"A heading that is off by more within one frame is a mistaken marker; {BY_HAND}."
    )
    patch_side: int = setting(
        7, "places", f"A round patch of floor is first searched for at this many places per side; {BY_HAND}."
    )
    patch_radii: tuple[float, ...] = setting(
        (0.06, 0.12, 0.2, 0.3), "of the floor's diagonal", f"Radii with which a patch is first searched for; {BY_HAND}."
    )
    formula_own_left: float = setting(
        0.02,
        "1",
        "A term is no part of a formula if the model's own numbers do all but this fraction of what it does: beside a "
        f"wheelbase, a gain of the turn rate may be anything; {BY_HAND}.",
    )
    formula_terms: int = setting(
        3, "terms", f"Largest number of terms of a formula, which should be short enough to be read; {BY_HAND}."
    )
    input_least: float = setting(
        0.02, "1", f"Least fraction of the squared error that a variable must explain to be named; {BY_HAND}."
    )
    input_most: int = setting(
        3,
        "variables",
        "Largest number of variables that are named, one after the other; further ones mostly repeat the first.",
    )
    input_ridge: float = setting(1.0, "1", f"Shrinkage of curves towards zero, in commands of typical size; {BY_HAND}.")
    neighbours: int = setting(
        3,
        "patterns",
        "How near the data are is measured by the mean distance to this many training patterns, in inputs scaled "
        f"from -1 to 1; {BY_HAND}.",
    )
    usual_share: float = setting(
        0.95,
        "1",
        "A command counts as near the patterns if it lies as close to them as this fraction of the patterns do to "
        f"one another; {BY_HAND}.",
    )
    fewest_commands: int = setting(
        30, "commands", f"With fewer commands near the patterns, nothing is concluded; {BY_HAND}."
    )
    fewest_trials: int = setting(6, "trials", f"Nor from commands of fewer trials: each fold needs some; {BY_HAND}.")
    sparse_draws: int = setting(
        1000,
        "samples",
        "Bootstrap samples over trials: the ends of a 95 % interval are then known to 10 % of its width.",
    )
    sparse_least: float = setting(
        0.1, "1", f"Least fraction of the squared error for which thin data are named; {BY_HAND}."
    )
    sparse_chance: float = setting(
        0.01,
        "1",
        "The part of the errors that the inputs predict is subtracted if chance would give it with a smaller "
        f"probability than this; {BY_HAND}.",
    )
    memory_s: float = setting(0.5, "s", "Time constant of the memory that is searched for: that of slow motors.")
