"""Settings of the search for missing effects, of ties, and of the verdict."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Select:
    """``select/``: which effects are accepted, what they cannot be told from, and longer explanations that do the same."""

    false_alarm: float = setting(
        0.05, "1", "Chance of any false alarm over the whole catalogue: the usual level, shared out over the effects."
    )
    min_gain: float = setting(
        0.001,
        "1",
        "Least gain that counts, as a share of the loss: honest robots vary by fractions of a percent from trial to trial.",
    )
    least_fall: float = setting(
        0.02,
        "1",
        "Of several effects, one that lowers the held-out error (root mean square, median, heading) by less than this fraction "
        "at every horizon is not named. Of 114 generated worlds with one hidden effect the weakest lowered it by 15 %; a clock "
        "offset that only stood for half a step of another simulator's integration by 1 %.",
    )
    least_fall_luck: float = setting(
        0.3,
        "1",
        "Over the root of the number of windows: so much more is asked where these are few. An effect that does nothing lowered "
        "an error of 16 windows by 2.5 %, one of 71 by 1 %.",
    )
    least_fall_windows: int = setting(
        200,
        "windows",
        "The median counts in that from so many windows on: an effect that does nothing changed it by 0.7 % of 428 windows, by "
        "7.5 % of 71.",
    )
    screen: float = setting(
        0.15,
        "1",
        f"An effect is tried in another one's place if its best start alone does this share of the other's work; {BY_HAND}.",
    )
    behind: float = setting(
        0.5,
        "1",
        f"It is dropped if, fitted, it leaves more than this share of that work undone and also `behind_loss`; {BY_HAND}.",
    )
    behind_loss: float = setting(
        20.0, "log-likelihood", "The loss that it must also leave: three standard errors, were it noise alone."
    )
    clocks_chance: float = setting(
        0.01, "1", f"Chance of a false alarm about clocks that differ from trial to trial; {BY_HAND}."
    )
    most_effects: int = setting(
        6,
        "effects",
        f"Effects that a search accepts at most: beyond, each only corrects what the others left of a seventh; {BY_HAND}.",
    )
    screen_most: int = setting(
        8, "effects", f"Where fits are costly, so many effects at most are fitted after each step of a search; {BY_HAND}."
    )
    screen_chance: float = setting(
        0.2, "1", f"And only those that luck alone does not make look as good in one case of five, on few cycles; {BY_HAND}."
    )
    screen_share: float = setting(
        0.6,
        "1",
        "The slope along a number is taken from neutral to this share of what is plausible: limits do nothing at first; "
        f"{BY_HAND}.",
    )
    tie_z: float = setting(
        2.0,
        "standard errors",
        "Two explanations whose held-out losses differ by fewer cannot be told apart: the usual 95 %.",
    )
    tie_signs_z: float = setting(
        4.0,
        "standard errors",
        f"Unless nearly all trials are against one of them, by so many standard errors of a fair coin; {BY_HAND}.",
    )
    tie_share: float = setting(
        0.001,
        "1",
        "Nor can those be told apart that differ by a smaller share of what either earns: no model drives as exactly as that.",
    )
    tie_loss: float = setting(
        3.0,
        "log-likelihood",
        "Nor those that differ by less over all trials: odds of twenty to one. A spare number costs as much.",
    )
    pair_left_over: float = setting(
        0.03,
        "1",
        "A pair is tried in place of one effect if, to first order, it leaves at most this share of that effect's work undone; "
        f"{BY_HAND}.",
    )
    pair_alone: float = setting(
        0.1,
        "1",
        "And neither of the pair alone leaves less than this: with that one alone, the other would have nothing to do; "
        f"{BY_HAND}.",
    )
    pair_tried: int = setting(
        2,
        "pairs",
        f"So many pairs are fitted for each accepted effect, the most promising first, to save time; {BY_HAND}.",
    )
    pair_small: float = setting(
        1e-3, "1", f"Step of a number for a derivative, as a share of its plausible range; {BY_HAND}."
    )


@dataclass(frozen=True)
class Verdict:
    """``diagnosis.py``, ``caveats.py``, ``comparison.py``: what is said beside and instead of an effect."""

    few_trials: int = setting(
        40,
        "trials",
        f"With at least so many, a candidate that was nearly accepted is no hint of too few data; {BY_HAND}.",
    )
    hint: float = setting(
        3.0,
        "1",
        "A candidate whose chance is within this factor of what would be accepted is a hint that more trials would settle; "
        f"{BY_HAND}.",
    )
    notable: float = setting(
        0.01, "1", f"An effect that would have earned this share of the loss, but is rejected, is mentioned; {BY_HAND}."
    )
    bins: int = setting(8, "bins", f"Bins (of as many values each) of a curve of errors along a variable; {BY_HAND}.")
