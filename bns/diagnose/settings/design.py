"""Settings of the next experiment: arena, sequences, search, when it decides."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Design:
    """``design/``: trials that discriminate between competing models in the least robot time."""

    most_models: int = setting(
        3,
        "models",
        "Largest number of explanations that are compared with each other after a clear verdict: the number of "
        f"pairs grows with the square; {BY_HAND}.",
    )
    most_tied_models: int = setting(5, "models", f"The same after a tie, where each may be the true one; {BY_HAND}.")
    together_m: float = setting(
        0.15, "m", f"Trials that began within this distance (median) of one place have a common start; {BY_HAND}."
    )
    trial_s: tuple[float, float] = setting(
        (6.0, 25.0), "s", f"A planned trial is as long as the trials of the log, within these bounds; {BY_HAND}."
    )
    heading_rad: float = setting(
        math.pi / 2, "rad", "A start without a heading faces north, as in every task of the Khepera."
    )
    largest_m: float = setting(1000.0, "m", f"A longer side of an arena is a mistaken unit; {BY_HAND}.")
    margin_m: float = setting(
        0.05,
        "m",
        "Sequences keep this distance from the edge of the arena: competing models disagree, and motors vary; "
        f"{BY_HAND}.",
    )
    briefest: float = setting(
        1 / 3,
        "1",
        "Candidate trials may be as short as this fraction of the usual length: where each is informative enough, "
        f"their number counts; {BY_HAND}.",
    )
    tries: int = setting(
        12, "draws", f"A command that leaves the arena is drawn again up to this many times; {BY_HAND}."
    )
    along: int = setting(
        4, "places", f"Points on a command's arc at which the arena is checked, its end included; {BY_HAND}."
    )
    place_rounds: int = setting(
        3,
        "rounds",
        "An effect of the floor depends on the robot's position, and the position on the effect: each iteration adds one "
        "power of the effect.",
    )
    pool: int = setting(200, "sequences", f"Size of the random pool; the time is proportional to it; {BY_HAND}.")
    generations: int = setting(4, "generations", f"Number of times that the best sequences are varied; {BY_HAND}.")
    most_times: int = setting(
        3,
        "times",
        "A trial is driven at most this many times: a world that resembles neither model shows itself in many "
        f"different trials, not in one; {BY_HAND}.",
    )
    repeat_step_s: float = setting(
        0.02, "s", f"Time step in which the length of a repeated cycle of a robot on joints is computed; {BY_HAND}."
    )
    placing_s: float = setting(
        10.0, "s", f"Assumed time for placing the robot, when trials of different lengths are compared; {BY_HAND}."
    )
    scale: float = setting(
        8.0, "log-likelihood", f"Above this discrimination, each further unit counts less; {BY_HAND}."
    )
    enough: float = setting(20.0, "log-likelihood", f"Discrimination with which a pair is nearly decided; {BY_HAND}.")
    urgent: float = setting(
        4.0,
        "1",
        f"Weight of reaching `enough`: a pair that is decided must not take time from one that is not; {BY_HAND}.",
    )
    power_draws: int = setting(
        2000, "samples", "Samples of a planned outcome: a probability of 0.9 is then known to 0.007 (standard error)."
    )
    power_points: int = setting(
        9, "points", "Points of the curve of the power against minutes: enough to see where it rises."
    )
    most_repeats: int = setting(
        64,
        "times",
        "A plan that does not suffice is imagined driven so many times at most; one that would not decide then is said to take "
        f"as long as the longest experiment; {BY_HAND}.",
    )
    target_power: float = setting(
        0.9, "1", f"An experiment counts as decisive if it decides with this probability: a usual power; {BY_HAND}."
    )
    longest_minutes: float = setting(
        24 * 60.0, "min", f"Robot time (a day) beyond which no experiment is taken to separate a pair; {BY_HAND}."
    )
    alike_rms: float = setting(
        0.01,
        "standard deviations",
        "Explanations whose predictions differ by less than this fraction of the noise (root mean square over the most telling "
        "commands, after each has adjusted its numbers) agree for every command. At 25 poses a second it would take an hour to "
        f"tell them apart, and no robot repeats itself so exactly; {BY_HAND}.",
    )
    least_standard_errors: float = setting(
        1.0,
        "standard errors",
        "Trials that are expected to show a smaller difference are not proposed: the diagnosis asks for `tie_z`, which they "
        f"would show once in six times; {BY_HAND}.",
    )
    most_faster: float = setting(100.0, "1", f"Larger ratios are not reported; {BY_HAND}.")
    dense: float = setting(
        3.0, "poses", f"From this many poses per command on, they count as a track at the camera's rate; {BY_HAND}."
    )
