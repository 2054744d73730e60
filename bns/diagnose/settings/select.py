"""Settings of the search for missing effects, of ties, and of the verdict."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Select:
    """``select/``: which effects are accepted, what they cannot be told apart from, and explanations with more effects."""

    false_alarm: float = setting(
        0.05,
        "1",
        "Probability of any false alarm over the whole catalogue: the usual level, divided by the number of effects.",
    )
    body_alone: int = setting(
        3,
        "effects",
        "Of a body on joints, where the error may not fall with the effects of the search, so many of those that it found alone "
        f"are simulated in their place; each takes half a minute; {BY_HAND}.",
    )
    min_gain: float = setting(
        0.001,
        "1",
        "Least gain that counts, as a fraction of the loss: robots without a missing effect vary by fractions of a "
        "percent from trial to trial.",
    )
    variant_evidence: float = setting(
        3.0,
        "log-likelihood",
        "An effect that has the parameters of another one and only acts at another place in the chain is taken instead of it if "
        "held-out trials are more likely by this much, summed over all: odds of 20 to 1.",
    )
    variant_certain: float = setting(
        6.9,
        "log-likelihood",
        "Below this difference (odds of 1000 to 1) a note says that the place in the chain is not certain. In one of 30 "
        "generated worlds with two effects the wrong place was chosen, by 4.8.",
    )
    variant_same: float = setting(
        0.05,
        "log-likelihood",
        "A smaller difference is none: without limits or dead zones of the motors, both places are the same.",
    )
    least_fall: float = setting(
        0.02,
        "1",
        "An effect that lowers the held-out error (root mean square, median, heading) by less than this fraction at every "
        "horizon is not named, also where it is the only one. Of 114 generated worlds with one hidden effect the "
        "weakest lowered it by 15 %; a clock offset that only compensated for half a time step of another simulator, by 1 %. A "
        "body with nothing hidden, written independently, was said to have one link with 1.10 times the friction, which lowered "
        "it by 0.02 %. By this fraction an error must also rise before effects or terms are withdrawn for it, and differ before "
        "an explanation that fits as well is no tie; a term that lowers no error by it is left out.",
    )
    least_shift: float = setting(
        0.1,
        "1",
        "An effect that lowers no error by `least_fall` is named nevertheless, if without it a number of an effect that does "
        "lower one is certainly another one, by this fraction of what that effect does. Without a gain of 0.99 a dead zone of "
        "5.3 mm/s became one of 6.5 (22 %); without a backlash that did not exist the numbers of a controller's overshoot "
        "changed by 3 %: two logs of independent simulators. No such effect was found in 226 generated worlds.",
    )
    least_fall_luck: float = setting(
        0.3,
        "1",
        "This, divided by the square root of the number of windows, is added to `least_fall`: with few windows more is required. "
        "An effect without influence lowered an error over 16 windows by 2.5 %, one over 71 by 1 %.",
    )
    least_fall_windows: int = setting(
        200,
        "windows",
        "From this many windows on, the median error counts as well: an effect without influence changed it by 0.7 % over 428 "
        "windows, by 7.5 % over 71.",
    )
    screen: float = setting(
        0.15,
        "1",
        "An effect is tried in place of an accepted one if, at its best start value alone, it achieves this "
        f"fraction of the other's gain; {BY_HAND}.",
    )
    behind: float = setting(
        0.5,
        "1",
        "Such an effect is dropped if, when fitted, it misses more than this fraction of the other's gain and also more "
        "than `behind_loss`. For a body, also: effects whose gain is at least this fraction of the best one's are simulated "
        f"at their own parameters before they are compared; {BY_HAND}.",
    )
    behind_loss: float = setting(
        20.0,
        "log-likelihood",
        "The log-likelihood by which such an effect must also be worse to be dropped: three standard errors, if the "
        "difference were noise alone.",
    )
    simple_first: float = setting(
        0.8,
        "1",
        "An effect that extends a simpler one and would replace an accepted effect is passed over if the simpler one, added to "
        "the accepted effects, gains at least this fraction. In a log of an independent simulator, friction in the gears instead "
        "of friction of both wheels gained 34.7 per trial, an added lag 33.7; after the first, the true explanation (a friction "
        "that fades, and a lag) was not found.",
    )
    clocks_chance: float = setting(
        0.01, "1", f"Probability of a false alarm about clocks that differ between trials; {BY_HAND}."
    )
    curve_from: int = setting(
        3,
        "effects",
        "Once so many effects are accepted, the search ends where a flexible term predicts clearly better than the next one, "
        "and as many terms better than all effects that would follow: what is missing is not in the catalogue. In 96 worlds "
        "with up to three effects and nine logs of real robots no search was ended. Of nine worlds with four or five, the "
        "first condition alone would have ended two wrongly; the second prevents it.",
    )
    most_effects: int = setting(
        6,
        "effects",
        "Largest number of effects that a search accepts: later ones mostly correct what earlier ones explain "
        f"imperfectly; {BY_HAND}.",
    )
    screen_most: int = setting(
        8,
        "effects",
        f"Where fits are costly, at most this many effects are fitted after each step of the search; {BY_HAND}.",
    )
    screen_first: float = setting(
        0.3,
        "1",
        "At most this fraction of all effects goes on from the screening on the fewest cycles to the one on more. In nine "
        f"bodies, the hidden effect was the first or the second of 40; {BY_HAND}.",
    )
    screen_behind: float = setting(
        0.2,
        "1",
        "Only effects whose gain in a screening is at least this fraction of the best one's go on, or are fitted. In nine "
        "bodies, the hidden effect was the best or the second best on 64 cycles, and "
        "none that stood further behind was ever taken.",
    )
    screen_chance: float = setting(
        0.2, "1", f"On few cycles, only effects go on whose p-value is below this; {BY_HAND}."
    )
    screen_chance_of_all: float = setting(
        0.05,
        "1",
        "On all cycles, only effects whose p-value is below this are fitted: to be accepted, they need one below a thousandth.",
    )
    screen_share: float = setting(
        0.6,
        "1",
        "The slope along a parameter is taken between the neutral value and this fraction of the plausible range, "
        f"because limits have no influence at first; {BY_HAND}.",
    )
    tie_z: float = setting(
        2.0,
        "standard errors",
        "Two explanations cannot be told apart if their held-out losses differ by fewer standard errors: the usual "
        "level of 95 %.",
    )
    tie_signs_z: float = setting(
        4.0,
        "standard errors",
        "Except where nearly all trials favour the same one: by at least this many standard errors in a sign test over "
        f"trials; {BY_HAND}.",
    )
    tie_share: float = setting(
        0.001,
        "1",
        "Nor can two explanations be told apart if their held-out losses differ by a smaller fraction of the gain of "
        "either: no model is that exact.",
    )
    tie_nearly: float = setting(
        0.1,
        "1",
        "Nor if one, with no more numbers, reaches all but this fraction of the other's gain, and no held-out error is higher "
        f"with it by `least_fall`; {BY_HAND}. In four logs of two independent simulators, speed controllers of 4 to 6 ms as a "
        "motor lag lost 1.8 to 5.6 % of the gain of a delay or a clock's offset, which had been named without it. An understeer "
        "in the place of a wheelbase lost 4.8 %: there the errors decide.",
    )
    tie_loss: float = setting(
        3.0,
        "log-likelihood",
        "Nor if their losses, summed over all trials, differ by less: odds of twenty to one. A superfluous parameter "
        "costs as much.",
    )
    pair_left_over: float = setting(
        0.03,
        "1",
        "A pair is tried in place of one effect if, to first order, it misses at most this fraction of that "
        f"effect's gain; {BY_HAND}.",
    )
    pair_alone: float = setting(
        0.1,
        "1",
        "A pair is tried only if each of its effects alone misses at least this fraction: otherwise the other one would "
        f"have nothing left to explain; {BY_HAND}.",
    )
    pair_tried: int = setting(
        2,
        "pairs",
        "At most this many pairs are fitted for each accepted effect, the most promising first, to save time; "
        f"{BY_HAND}.",
    )
    pair_small: float = setting(
        1e-3, "1", f"Step of a parameter for a derivative, as a fraction of its plausible range; {BY_HAND}."
    )


@dataclass(frozen=True)
class Verdict:
    """``diagnosing.py``, ``caveats.py``, ``comparison.py``: what is reported in addition to an effect, or instead of one."""

    few_trials: int = setting(
        40,
        "trials",
        "With at least this many trials, a candidate that was nearly accepted is not taken as a sign of too few "
        f"data; {BY_HAND}.",
    )
    hint: float = setting(
        3.0,
        "1",
        "A candidate whose p-value is within this factor of the threshold is a sign that more trials would decide; "
        f"{BY_HAND}.",
    )
    fewest_clocks: int = setting(
        5,
        "trials",
        "With fewer trials, nothing is said of clocks that change along the session, whatever the p-value; "
        f"{BY_HAND}.",
    )
    clock_steady: float = setting(
        0.9,
        "correlation",
        "Clocks of trials that follow the session less closely do not differ by a rate: a queue of commands that fills and "
        "empties again gave 0.38. Four fifths of their change must be even.",
    )
    often: float = setting(
        1 / 3,
        "1",
        "From this fraction of the trials on, moments with large errors are called too frequent for accidents; "
        f"{BY_HAND}.",
    )
    notable: float = setting(
        0.01,
        "1",
        f"An effect that would have gained this fraction of the loss, but is rejected, is mentioned; {BY_HAND}.",
    )
    scatter_notable: float = setting(
        2.0,
        "of the tracking noise",
        "Where nothing is left and the error is larger by this factor, the scatter of the drive is named as its cause; "
        f"{BY_HAND}.",
    )
    scatter_explains: float = setting(
        0.7,
        "1",
        "The scatter of the drive, with tracking noise, is named as the cause of an error if it makes at least this fraction of "
        f"it, and not so much more than all of it: half of the mean square; {BY_HAND}.",
    )
    outgrown: float = setting(
        2.0,
        "1",
        "An effect whose number is certainly further from neutral by this factor with a free term than without it, or "
        "certainly on the other side of neutral, is said to cancel a part of that term: what is added for the rest should not "
        "multiply what was found before. With a free answer to past commands, also one that is certainly nearer by this "
        f"factor: such an answer contains lags; {BY_HAND}.",
    )
    bins: int = setting(
        8, "bins", f"Bins, with equal numbers of values, of a curve of errors along a variable; {BY_HAND}."
    )
