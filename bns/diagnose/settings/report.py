"""Settings of what a report shows. None has a say in a verdict."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Report:
    """``report/``: how much of a table, a path or a list is shown."""

    most_trials: int = setting(
        24, "trials", f"Largest number of trials whose paths a page shows, to keep it small; {BY_HAND}."
    )
    most_poses: int = setting(
        160, "poses", f"Largest number of poses of a path: more than a screen can show; {BY_HAND}."
    )
    strange: float = setting(
        6.0,
        "1",
        "Trials whose error is this many times the median are shown last: probably their first pose was a mistaken "
        f"marker, not an error of the model; {BY_HAND}.",
    )
    rows: int = setting(8, "rows", f"Rows of a ranking in the terminal; {BY_HAND}.")
    moments: int = setting(4, "trials", f"Largest number of trials whose moment that stands out is described; {BY_HAND}.")
    network_bins: int = setting(8, "bins", f"Bins of a figure of networks' errors; {BY_HAND}.")
    large: float = setting(1.0, "s or m", "From one second or one metre on, values are not shown in ms or mm.")
    by_factor: float = setting(
        2.0, "1", f"From this factor on, up or down, a sentence says a factor and not a percentage; {BY_HAND}."
    )
    causes: int = setting(3, "causes", f"Largest number of causes in a headline; {BY_HAND}.")
    listed_causes: int = setting(
        3, "causes", f"From so many effects on, the head of a page lists what happens instead of one sentence; {BY_HAND}."
    )
    legend_characters: int = setting(
        96, "characters", "Names of this length in all fit side by side below a figure of a page's width, with their lines."
    )
    tick_characters: int = setting(
        45, "characters", "Names that are longer together would touch each other along the axis of a figure: they are turned."
    )
    no_width: tuple[float, float] = setting(
        (1e-5, 1e-7),
        "1",
        "An interval whose ends differ by less than the first share, or, where they are above 1 in SI units, by less than that "
        f"number or the second share, says nothing and is not shown; {BY_HAND}.",
    )
    same_share: float = setting(
        0.005,
        "1",
        "Where a wheel's speed divided by its command differs by less than this from speed to speed, the words say that it is "
        f"slower or faster by one share, and not that it is out of proportion; {BY_HAND}.",
    )
    flat_share: float = setting(
        0.3,
        "1",
        "Where a free surface over speed and turn rate varies by less than this share of its median, the words say that it is "
        f"alike at nearly all speeds and turn rates; {BY_HAND}.",
    )
    surface_ends: tuple[float, float] = setting(
        (0.05, 0.95), "of the commands", f"Quantiles between which the words give the values of such a surface; {BY_HAND}."
    )
    cancel_steps: float = setting(
        0.1,
        "of the time",
        "Each of several flexible terms is judged where its contributions to a velocity are largest, either way: in so much of "
        f"the time in which the robot drove; {BY_HAND}.",
    )
    cancel_part: float = setting(
        0.5,
        "of its contribution",
        "If all terms together leave less of a term there, a sentence about it would be false, and none is said. Of terms that "
        "cancel -0.5 to 0.3 was left (eight terms for firmware that keeps turns, another author's simulator), of terms for "
        "unlike wheels 1.0. Nor is anything said of a neighbourhood where the poses differ from the sum by more than this share.",
    )
    cancel_side: float = setting(
        0.2,
        "of the other side",
        "What a term adds to one side is judged if it is larger than this share of what it adds to the other; "
        f"{BY_HAND}.",
    )
    together_cell: float = setting(
        0.2,
        "of the fastest",
        "Width of a neighbourhood of speeds and turn rates, or of half the range of places and times, over which the change that "
        f"all terms make is a median: eleven a variable; {BY_HAND}.",
    )
    together_driven: float = setting(
        0.01,
        "of the time",
        "Of a neighbourhood in which the robot drove for less, nothing is said. With 60 trials of 8 s it is some five commands.",
    )
    together_nothing: float = setting(
        0.1,
        "of the largest change",
        f"The words say that the terms leave a velocity as it is where they change it by less than this share; {BY_HAND}.",
    )
    together_least: float = setting(
        0.01,
        "of the usual velocity",
        f"A change of a velocity that is smaller everywhere is not said beside others; {BY_HAND}.",
    )
    formula_width: int = setting(
        90, "characters", f"A longer formula is not shown in the terminal, only said where it is written; {BY_HAND}."
    )
    once_share: float = setting(
        0.5,
        "1",
        "Where one moment makes up this share of what a trial's loss has beyond the usual, a note says that something happened "
        f"there, and else that the whole trial differs; {BY_HAND}.",
    )
    frame_s: float = setting(0.1, "s", f"Time between the points of a planned path that is drawn; {BY_HAND}.")
    planned_trials: int = setting(3, "trials", f"Proposed trials that a figure shows; {BY_HAND}.")
