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
        f"Explanations compared with each other at most, after a clear verdict: pairs grow with the square; {BY_HAND}.",
    )
    most_tied_models: int = setting(5, "models", f"The same after a tie, where each may be the true one; {BY_HAND}.")
    together_m: float = setting(
        0.15, "m", f"Trials that began within this (median) of one place have a common start; {BY_HAND}."
    )
    trial_s: tuple[float, float] = setting(
        (6.0, 25.0), "s", f"A planned trial is as long as those seen, within these bounds; {BY_HAND}."
    )
    heading_rad: float = setting(
        math.pi / 2, "rad", "A start without a heading faces north, as that of every task of the Khepera does."
    )
    largest_m: float = setting(1000.0, "m", f"A longer side of an arena is no arena but a mistaken unit; {BY_HAND}.")
    margin_m: float = setting(
        0.05,
        "m",
        f"Sequences keep this far from the arena's edge: competing models disagree, and motors vary; {BY_HAND}.",
    )
    briefest: float = setting(
        1 / 3,
        "1",
        "Trials that are searched for may be as short as this share of the usual: where each tells enough, their number counts; "
        f"{BY_HAND}.",
    )
    tries: int = setting(12, "draws", f"So often a command that leaves the arena is drawn again; {BY_HAND}.")
    along: int = setting(4, "places", f"Places on a command's arc that are looked at, its end among them; {BY_HAND}.")
    place_rounds: int = setting(
        3,
        "rounds",
        "What the floor does depends on where the robot is, which depends on what the floor does: each round adds a power of it.",
    )
    pool: int = setting(200, "sequences", f"Size of the random pool: more costs time in proportion; {BY_HAND}.")
    generations: int = setting(4, "generations", f"So often the best get children; {BY_HAND}.")
    most_times: int = setting(
        3,
        "times",
        "A trial is driven this often at most: a world that is like neither model shows in many different trials, not in one; "
        f"{BY_HAND}.",
    )
    repeat_step_s: float = setting(
        0.02, "s", f"Step in which the length of a repeated cycle of a robot on joints is worked out; {BY_HAND}."
    )
    placing_s: float = setting(
        10.0, "s", f"What placing the robot is reckoned at when trials of different lengths are weighed; {BY_HAND}."
    )
    scale: float = setting(
        8.0, "log-likelihood", f"Discrimination from which on more of it counts less and less; {BY_HAND}."
    )
    enough: float = setting(20.0, "log-likelihood", f"Discrimination that nearly decides; {BY_HAND}.")
    urgent: float = setting(
        4.0,
        "1",
        "How much reaching `enough` counts: a pair that is decided must not take the time of one that is not; "
        f"{BY_HAND}.",
    )
    power_draws: int = setting(
        2000,
        "samples",
        "Samples of a planned outcome: a probability of 0.9 is then known within 0.007 (standard error).",
    )
    power_points: int = setting(
        9, "points", "Of the curve of the chance of a decision against minutes: enough to see where it rises."
    )
    target_power: float = setting(
        0.9, "1", f"An experiment decides if it does so with this probability: a usual power; {BY_HAND}."
    )
    longest_minutes: float = setting(
        24 * 60.0, "min", f"Robot time (a day) beyond which a pair counts as the same for every experiment; {BY_HAND}."
    )
    most_faster: float = setting(100.0, "1", f"Ratios above this are not counted; {BY_HAND}.")
    dense: float = setting(
        3.0, "poses", f"Poses a command from which on they count as a track at the camera's rate; {BY_HAND}."
    )
