"""Settings of fits: noise, search, starts, folds, significance, clocks of trials."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting

_NOISE_UNITS = "m, rad, m/√m, m/√m, rad/√m"


@dataclass(frozen=True)
class Estimate:
    """``estimate/``: how parameters are fitted, and whether a model predicts held-out trials better than another."""

    folds: int = setting(
        5, "folds", f"Each fifth of the trials is predicted from the other four, a usual number of folds; {BY_HAND}."
    )
    fit_rounds: int = setting(25, "steps", f"Largest number of steps of a fit; {BY_HAND}.")
    fit_settled: float = setting(
        1e-2,
        "log-likelihood",
        "A step that lowers the loss by less ends the fit: parameters are then within a tenth of their standard "
        "error.",
    )
    together_chance: float = setting(
        0.05,
        "1",
        "An effect, each of whose numbers may be the neutral one, acts all the same if chance alone sets all of them as far off "
        "together more rarely than this: the complement of the 95 % of the intervals.",
    )
    singular: float = setting(
        1e-12,
        "1",
        "A direction in which the curvature, in units in which that of each number is 1, is a smaller share of the largest is "
        "taken for rounding: slopes by differences are right to about a millionth, which squared is this.",
    )
    fit_trusted: float = setting(
        0.75,
        "1",
        "The Jacobian is used for another step if the last step achieved this fraction of the predicted decrease. "
        "It came with a change that saved a third of the CPU time; parameters moved by at most 0.08 standard errors.",
    )
    slope_ruled: float = setting(
        0.9,
        "1",
        "Fraction of a column of the Jacobian (sum of squares) from which one trial is suspected of a jump of the loss, and the "
        "slope to the other side is asked as well. In the log where this was found, a jump held 0.9998; by hand.",
    )
    valley_better: float = setting(
        0.5,
        "log-likelihood",
        "A fit from another start counts as another minimum if its loss is lower by this; smaller differences are "
        "rounding errors.",
    )
    lacking_lost: float = setting(
        2.0,
        "1",
        "A fit without an effect whose loss rises by more than this many times what the curvature promises is begun again under "
        "more noise: robust losses grow more slowly than the quadratic form, so only a fit that lost its way ends above it. A "
        "gain of 1.095 that a curve took back to 1.013 seemed to be needed: without it the loss ended at 18 times as much.",
    )
    set_rounds: int = setting(
        3,
        "rounds",
        "Noise and parameters are estimated alternately this many times; the second round changes parameters by "
        "hundredths of a standard error.",
    )
    smoothing_within: float = setting(
        3.0,
        "1",
        "The time constant of a tracker that smooths its poses is sought within this factor of that of the motors' lag, in whose "
        f"place it would stand; {BY_HAND}.",
    )
    huber: float = setting(
        3.5,
        "standard deviations",
        "Whitened residuals (three numbers per frame) beyond this length count linearly, because outliers are "
        "normal. Of Gaussian residuals 0.7 % are longer (chi, three degrees of freedom).",
    )
    noise_trials: int = setting(
        24, "trials", "The noise is estimated from at most this many trials: enough for its five numbers."
    )
    noise_guess: tuple[float, ...] = setting(
        (2e-3, 8e-3, 4e-3, 2e-3, 2e-2),
        _NOISE_UNITS,
        "Start values of the noise estimate: position and heading of a tracked pose; scatter of the drive forward, "
        f"sideways and in heading, per square root of a metre driven; {BY_HAND}.",
    )
    noise_low: tuple[float, ...] = setting(
        (2e-5, 1e-4, 1e-5, 1e-5, 1e-4), _NOISE_UNITS, f"Lower bounds of the noise estimate; {BY_HAND}."
    )
    noise_high: tuple[float, ...] = setting(
        (0.3, 0.5, 0.5, 0.5, 3.0), _NOISE_UNITS, f"Upper bounds of the noise estimate; {BY_HAND}."
    )
    look_reach: float = setting(
        0.14,
        "1",
        "How far to either side of where a fit of a body ended lower places are looked for, as a fraction of the plausible range "
        "(of a factor by ratio); within `wide_step`, so that nothing is simulated for it.",
    )
    slope_shorter: int = setting(
        10,
        "times",
        "The step for the slope of a number in a formula is divided by ten at most this often, until it moves no innovation by "
        "more than the filter trusts one: a term in the square of 1000 s needs six, in its cube nine.",
    )
    look_steps: int = setting(
        7, "values", "Number of values tried on each side: with one every fiftieth of the range, valleys as narrow are seen."
    )
    look_rounds: int = setting(3, "rounds", f"From a lower place the fit begins again, at most this often; {BY_HAND}.")
    profile_step: float = setting(
        0.04,
        "1",
        "Distance of the values at which a body is simulated at last, to see where a number is best, as a fraction of the "
        f"plausible range (of a factor by ratio); at least one standard error; {BY_HAND}.",
    )
    profile_points: int = setting(
        5, "values", "The parabola goes through the losses at this many values about the least: two on either side of it."
    )
    profile_farthest: int = setting(
        7, "steps", f"Values are added beyond an end beside which the loss is least, up to this many steps away; {BY_HAND}."
    )
    wide_step: float = setting(
        0.15,
        "1",
        "Step of the difference quotient from which the intervals of a body's parameters follow, as a fraction of the plausible "
        "range (of a factor by ratio): the response to a servo's strength has steps, and the slope within one of them says that "
        f"the parameter is known far better than it is; {BY_HAND}.",
    )
    stretch_farthest: float = setting(
        4.0,
        "1",
        "A frame of a body whose prediction is worse than half of the others, or than noise alone makes it, by more than this "
        "factor counts as if it were this bad: the body rolled over, in the simulation or on the floor. With the true "
        f"stiffness, one of 64 cycles made up 346 of a loss of 416; {BY_HAND}.",
    )
    stretch_guess: tuple[float, ...] = setting(
        (2e-3, 8e-3, 2e-3, 6e-3),
        "m, rad, m, rad",
        "Robots on joints: start values of the position and heading noise of a tracked pose, and of the drift of "
        f"both over a stretch; {BY_HAND}.",
    )
    stretch_low: tuple[float, ...] = setting(
        (2e-5, 1e-4, 1e-4, 3e-4), "m, rad, m, rad", f"Their lower bounds; {BY_HAND}."
    )
    stretch_high: tuple[float, ...] = setting((0.3, 0.5, 0.3, 0.5), "m, rad, m, rad", f"Their upper bounds; {BY_HAND}.")
    stretch_luck_factor: float = setting(
        2.718281828459045,
        "1",
        "Random disturbances are expected to have their usual strength within this factor (one standard deviation "
        "of the logarithm): few stretches hardly distinguish one kind of disturbance from another.",
    )
    stretch_luck_range: tuple[float, float] = setting(
        (0.1, 3.0),
        "1",
        "Bounds of their strength: no floor varies by more than 30 % (standard deviation) from cycle to cycle. "
        "Without bounds, the disturbances of a body with a joint at 0.4 of its strength were estimated as 9 times "
        "as strong as usual, and hid the joint.",
    )
    stretch_noise_of: int = setting(
        160,
        "stretches",
        "The noise is estimated from at most this many evenly spaced stretches: enough for its eight numbers.",
    )
    flips: int = setting(
        20_000,
        "samples",
        "Random sign flips of whole trials: a p-value of 0.002, near the usual threshold, is then known to 16 %.",
    )
    flips_seed: int = setting(
        20_250_101, "1", "A fixed key, so that the same data give the same p-value. Any number would do."
    )
    min_z: float = setting(
        2.5,
        "standard errors",
        f"Least gain that counts: it must come from many trials, not from a few; the number is {BY_HAND}.",
    )
    min_z_stretches: float = setting(
        0.5,
        "standard errors",
        "The same for cycles of robots on joints. Few cycles depend strongly on one joint, and a trial that has one "
        "gains many times what others do (a joint at 0.4 of its strength: p = 0.0008 and 0.9 standard errors). The "
        "sign-flip test still requires many trials: with ten trials, its p-value is at least 0.001, however much "
        "one of them gains.",
    )
    start_shares: tuple[float, ...] = setting(
        (0.01, 0.05, 0.2),
        "1",
        "Start values of an ordinary parameter: these fractions of the distance from the neutral value to either "
        f"end of the plausible range; {BY_HAND}.",
    )
    start_nothing: float = setting(
        5e-3,
        "trials",
        "If the total gain over all trials is below this multiple of one trial's loss, no fit is made: it would not "
        "count (`min_gain`).",
    )
    start_limits: int = setting(
        30,
        "starts",
        "Number of start values, evenly spaced on a logarithmic scale, of a parameter whose neutral value is "
        f"infinite; {BY_HAND}.",
    )
    start_between: int = setting(
        8,
        "values",
        "Where a formula's only number does nothing at some of its starts, so many more are tried between the best of the others "
        f"and the nearest of these, by ratio: 14 % apart where starts are three times apart; {BY_HAND}.",
    )
    start_most: int = setting(
        216,
        "starts",
        "All combinations of start values are tried up to this number (three ordinary parameters); beyond it, one "
        "parameter at a time is varied: four parameters would have 1,296 combinations, seven 280,000.",
    )
    jagged_points: int = setting(
        61,
        "values",
        "Values of a jagged parameter (a threshold, a period, the rim of a patch) at which the loss is computed: half of its "
        f"interval, at least a quarter of their range to one side, then has at least 7 of them; {BY_HAND}.",
    )
    jagged_rounds: int = setting(
        6, "rounds", f"Ranges of these values that are tried, each three times as wide or as narrow as the one before; {BY_HAND}."
    )
    jagged_equal: float = setting(
        0.05,
        "log-likelihood",
        "Values of a jagged parameter whose loss differs by less are equally good: between two commands a threshold changes "
        f"nothing; {BY_HAND}.",
    )
    jagged_ranges: tuple[float, float, float] = setting(
        (3.0, 0.8, 0.25),
        "1",
        "The range is made this many times wider if the interval reaches beyond the second of these fractions of it, and as "
        f"many times narrower if it stays within the third; {BY_HAND}.",
    )
    clock_blocks: int = setting(
        8,
        "blocks",
        "Blocks of a trial. With only an earlier and a later half, a clock that drifts would look different in the "
        "two.",
    )
    clock_fewest_frames: int = setting(
        24, "frames", "Trials with fewer frames (median trial), three per block, say too little about their own clocks."
    )
    clock_far: float = setting(
        0.05,
        "1",
        "If a larger fraction of the clocks is implausible, something else that differs between trials was taken "
        f"for a clock; {BY_HAND}.",
    )
    clock_least_scatter_s: float = setting(
        0.02,
        "s",
        "Clocks that differ by less (standard deviation) are treated as one clock: motors that start slightly late "
        "look the same.",
    )
    trial_clock_reach_s: float = setting(
        0.6, "s", f"Half the range in which a trial's clock is first searched for; {BY_HAND}."
    )
    trial_clock_scan: int = setting(25, "shifts", f"Number of shifts tried in that range, one every 0.05 s; {BY_HAND}.")
    trial_clock_small_s: float = setting(1e-3, "s", f"Step of a clock for the difference quotient; {BY_HAND}.")
    trial_clock_stiffness: float = setting(
        4.0,
        "1/s²",
        "Curvature that is added to the loss of each clock, one over half a second squared: a trial without "
        "information keeps its clock.",
    )
    trial_clock_rounds: int = setting(8, "steps", f"Largest number of Newton steps of the clocks; {BY_HAND}.")
    trial_clock_settled_s: float = setting(2e-4, "s", f"The search ends when no clock moves by more; {BY_HAND}.")
