"""Settings of fits: noise, search, starts, folds, significance, clocks of trials."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting

_NOISE_UNITS = "m, rad, drive (3)"


@dataclass(frozen=True)
class Estimate:
    """``estimate/``: how numbers are fitted, and whether a model is better than another on trials held out."""

    folds: int = setting(
        5, "folds", f"Each fifth of the trials is predicted from the other four: a usual number of folds; {BY_HAND}."
    )
    fit_rounds: int = setting(25, "steps", f"Steps of a search at most; {BY_HAND}.")
    fit_settled: float = setting(
        1e-2,
        "log-likelihood",
        "A step that lowers the loss by less ends the search: numbers are then within a tenth of their standard error.",
    )
    fit_trusted: float = setting(
        0.75,
        "1",
        "The Jacobian serves for another step if the last one earned this share of the predicted decrease. Came with the "
        "change that took a third off the CPU time: numbers moved by at most 0.08 standard errors.",
    )
    valley_better: float = setting(
        0.5,
        "log-likelihood",
        "A fit begun elsewhere counts as another valley if its loss is lower by this: less is rounding of the search.",
    )
    set_rounds: int = setting(
        3,
        "rounds",
        "Noise and numbers are settled in turn so often; the second round changes numbers by hundredths of a standard error.",
    )
    huber: float = setting(
        3.5,
        "standard deviations",
        "Whitened residuals (three numbers a frame) beyond this length count linearly: outliers are normal. Of Gaussian ones "
        "0.7 % are longer (chi, three degrees of freedom).",
    )
    noise_trials: int = setting(
        24, "trials", "The noise is estimated from so many trials at most: five numbers need no more."
    )
    noise_guess: tuple[float, ...] = setting(
        (2e-3, 8e-3, 4e-3, 2e-3, 2e-2), _NOISE_UNITS, f"Where the search for the noise begins; {BY_HAND}."
    )
    noise_low: tuple[float, ...] = setting(
        (2e-5, 1e-4, 1e-5, 1e-5, 1e-4), _NOISE_UNITS, f"Noise is sought above this; {BY_HAND}."
    )
    noise_high: tuple[float, ...] = setting(
        (0.3, 0.5, 0.5, 0.5, 3.0), _NOISE_UNITS, f"Noise is sought below this; {BY_HAND}."
    )
    stretch_guess: tuple[float, ...] = setting(
        (2e-3, 8e-3, 2e-3, 6e-3),
        "m, rad, m, rad",
        f"Robots on joints: where the search for position and heading noise of a tracked pose, and for the drift of both over a "
        f"stretch, begins; {BY_HAND}.",
    )
    stretch_low: tuple[float, ...] = setting((2e-5, 1e-4, 1e-4, 3e-4), "m, rad, m, rad", f"They are above this; {BY_HAND}.")
    stretch_high: tuple[float, ...] = setting((0.3, 0.5, 0.3, 0.5), "m, rad, m, rad", f"They are below this; {BY_HAND}.")
    stretch_luck_factor: float = setting(
        2.718281828459045,
        "1",
        "Luck is expected to be as strong as usual within this factor (one standard deviation of its logarithm): few stretches "
        "hardly tell one kind from another.",
    )
    stretch_luck_range: tuple[float, float] = setting(
        (0.1, 3.0),
        "1",
        "And never weaker or stronger than this: no floor changes by more than 30 % (standard deviation) from cycle to cycle. "
        "Unbounded, the luck of a body with a joint at 0.4 of its strength was 9 times as strong as usual, and hid the joint.",
    )
    stretch_noise_of: int = setting(
        160, "stretches", "The noise is estimated from so many stretches at most, evenly chosen: eight numbers need no more."
    )
    flips: int = setting(
        20_000,
        "samples",
        "Random sign flips of whole trials: a chance of 0.05 shared out over 25 effects (0.002) is then known to 16 %.",
    )
    flips_seed: int = setting(20_250_101, "1", "A fixed key: the same data have the same chance. Any number would do.")
    min_z: float = setting(
        2.5,
        "standard errors",
        f"Least gain that counts: it must be earned in many trials, not in a few; the number is {BY_HAND}.",
    )
    min_z_stretches: float = setting(
        0.5,
        "standard errors",
        "The same for cycles of robots on joints: few cycles need one joint much, and a trial that has one earns many times what "
        "others do (a joint at 0.4 of its strength: p = 0.0008 and 0.9 standard errors). That it is earned in many trials is in "
        "the chance by sign flips: of ten trials it is no rarer than 0.001, however much one of them earns.",
    )
    start_shares: tuple[float, ...] = setting(
        (0.01, 0.05, 0.2),
        "1",
        f"Starts of an ordinary number: these shares of the way from neutral to either end of what is plausible; {BY_HAND}.",
    )
    start_nothing: float = setting(
        5e-3,
        "trials",
        "A gain of fewer trials' losses than this, over all trials, does not justify a fit: it would not count (`min_gain`).",
    )
    start_limits: int = setting(
        30,
        "starts",
        f"Starts of a number that is neutral at infinity: so many, evenly spaced on a logarithmic scale; {BY_HAND}.",
    )
    start_most: int = setting(
        216,
        "starts",
        "All combinations of starts are tried up to this many (three ordinary numbers); beyond, one number at a time: four "
        "numbers would have 1,296 starts, seven 280,000.",
    )
    clock_blocks: int = setting(
        8, "blocks", "Blocks of a trial. An earlier and a later half would differ where the clock drifts too."
    )
    clock_fewest_frames: int = setting(
        24, "frames", "Trials with fewer (the median trial), three a block, say too little of their own clocks."
    )
    clock_far: float = setting(
        0.05,
        "1",
        "More of the clocks than this share outside of what is plausible: something that every trial has in another way was "
        f"taken for one; {BY_HAND}.",
    )
    clock_least_scatter_s: float = setting(
        0.02,
        "s",
        "Clocks that differ by less (standard deviation) are left alike: motors that start a little late look the same.",
    )
    trial_clock_reach_s: float = setting(
        0.6, "s", f"Clocks are first sought this far on either side of where they are; {BY_HAND}."
    )
    trial_clock_scan: int = setting(25, "shifts", f"A shift every 0.05 s of that reach; {BY_HAND}.")
    trial_clock_small_s: float = setting(1e-3, "s", f"Step of a clock for its slope; {BY_HAND}.")
    trial_clock_stiffness: float = setting(
        4.0,
        "1/s²",
        "Curvature that every clock has by itself, one over half a second squared: a trial that says nothing keeps its own.",
    )
    trial_clock_rounds: int = setting(8, "steps", f"Steps of the clocks at most, each a Newton step; {BY_HAND}.")
    trial_clock_settled_s: float = setting(2e-4, "s", f"Steps that move no clock by more end the search; {BY_HAND}.")
