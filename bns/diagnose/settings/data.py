"""Settings of how measurements become tracks: trials, tracker faults, rests, noise; with those of checks, guesses and bodies."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.bodies import Bodies
from bns.diagnose.settings.checks import Checks
from bns.diagnose.settings.gaps import Gaps
from bns.diagnose.settings.guesses import Guesses
from bns.diagnose.settings.setting import BY_HAND, setting
from bns.diagnose.settings.stamps import Stamps


@dataclass(frozen=True)
class Data(Bodies, Guesses, Checks, Gaps, Stamps):
    """``data/``: checks of tables, division of a log into trials, tracks, tracker faults, tracking noise."""

    still_m_s: float = setting(
        1e-3,
        "m/s",
        f"Wheels with a smaller commanded speed count as standing, because encoder readings fluctuate; {BY_HAND}.",
    )
    kept_standing_s: float = setting(
        1.0,
        "s",
        "How long a trial keeps standing before and after its drive, so that late starts and slow stops are "
        f"visible; {BY_HAND}.",
    )
    fault_ways: float = setting(
        3.0,
        "1",
        "A change of less than this many times the distance that the faster wheel drove is never a tracker fault: "
        "slip and gear errors stay below that.",
    )
    fault_usual: float = setting(
        12.0,
        "1",
        "A change of less than this many times the median of the trial is never a tracker fault, because fast "
        f"robots and coarse trackers differ; the number is {BY_HAND}.",
    )
    fault_most_cut: float = setting(
        0.2,
        "1",
        "At most this fraction of the poses is discarded because it follows a jump; the loss of precision is then "
        "under 12 %.",
    )
    fault_fewest_frames: int = setting(
        20, "frames", f"For a trial with fewer frames, the usual change is that of all trials; {BY_HAND}."
    )
    fault_around_s: float = setting(
        1.0,
        "s",
        "The fastest wheel command within this time before and after counts, because a robot may lag and clocks may "
        f"differ (`trial_clock_reach_s` is 0.6 s); {BY_HAND}.",
    )
    fault_away_s: float = setting(
        2.0,
        "s",
        "A pose that jumps away and comes back within this time, to where the robot may have driven, was mistaken in between: "
        f"only these poses are lost. In a longer time a robot may have driven anywhere; {BY_HAND}.",
    )
    settled_s: float = setting(
        0.5,
        "s",
        "A robot that is told to stand is not taken to rest before this time: ten times the lag of a small robot's motors. One "
        "that coasts for longer shows it (`rest_goes_on`).",
    )
    rest_goes_on: float = setting(
        3.0,
        "1",
        "The first part of a rest is left out if the robot is further along its way after it by more than this many times what "
        "noise does, which goes back as often. Of 1000 normal numbers 1.3 are larger. Simulated at 25 Hz: where nothing coasts "
        "this lowers the noise by less than 1 %, by up to 4 % where it is slow wander alone (0.95 from pose to pose, six rests); "
        "robots that coast raise it by up to 10 %, that of the heading by 44 % with a lag of 0.4 s, quick spins and rests of 1 "
        "to 2 s (by 10 to 1400 % where all poses of a rest count).",
    )
    rest_parts: int = setting(
        3,
        "parts",
        "The first of so many equal parts of a rest is compared with the others, and left out at once: three comparisons "
        f"shorten a rest of two seconds to 0.6 s; {BY_HAND}.",
    )
    rest_fewest_left: int = setting(
        9,
        "poses",
        "A rest whose begin was left out counts only if so many poses remain: in fewer, a robot that still coasts cannot be told "
        "from noise. With 5, a lag of 0.4 s before rests of 0.8 to 1.3 s raised the noise by 32 % (simulated).",
    )
    rest_least: float = setting(
        1e-6, "m, rad", "Smaller motion is rounding of the log: the noise of any tracker is a hundred times as large."
    )
    fewest_at_rest: int = setting(
        30,
        "poses",
        "The noise is estimated from poses at rest only if there are at least this many; its standard deviation is "
        "then known to within 13 %.",
    )
    rest_agrees: float = setting(
        3.0,
        "standard errors",
        "Where the scatter at rest and that at high frequency while the robot drives differ by less, the latter is taken, which "
        "comes of more poses: 30 poses at rest know the noise to 13 % only. Of 1000 logs with the same noise in both, 3 differ "
        "by more.",
    )
    grid_exact: float = setting(
        0.1,
        "1",
        "Poses count as rounded to multiples of a step if none is further from one than this fraction of the step. Poses that "
        "are not are on average a quarter of a step away.",
    )
    grid_fewest: int = setting(
        20, "values", "At least so many different values show whether poses are rounded: of a few, any are multiples of a step."
    )
    noise_trimmed: float = setting(
        3.0,
        "standard deviations",
        "Poses farther off do not count in the tracker's noise: of normal ones 0.27 %. With 3 % of the poses thirty times as far "
        "off, the noise comes out 0.6 % too large (by the median of the sizes: 3.4 %), and 2.3 times fewer poses do as well.",
    )
    noise_rounds: int = setting(
        3, "rounds", f"The limit beyond which poses do not count is taken from the noise found last, so often; {BY_HAND}."
    )
    trimmed_sd_se: float = setting(
        0.76,
        "1",
        "Relative standard error of a standard deviation without the numbers farther off, times the root of their number: of "
        "4000 draws of 60, 200 and 1000 normal numbers.",
    )
    drift_at_rest: float = setting(
        0.5,
        "1",
        "If poses at rest scatter about a line by less than this fraction of their scatter about their mean, the robot creeps, "
        "and the line is its own motion: white noise of a tracker keeps all of it, a random walk 0.63.",
    )
    parabola_frames: int = setting(
        7,
        "frames",
        "Number of frames to which a parabola is fitted. At 10 Hz this is 0.6 s, in which the path bends little "
        "under one command.",
    )
    parabola_order: int = setting(
        2, "1", "Motion at constant speed and turn rate is a parabola to second order in time."
    )
    parabola_slowest_hz: float = setting(
        8.0,
        "Hz",
        f"Below this frame rate a parabola over seven frames does not follow the motion of a robot; {BY_HAND}.",
    )
    most_frames: int = setting(
        16_000,
        "frames",
        "If there are more frames, an evenly spaced subset is used in the search, whose duration is proportional to "
        f"their number; neighbouring frames carry nearly the same information; the number is {BY_HAND}.",
    )
    run_up_s: float = setting(
        5.0,
        "s",
        "Where a table gives only one speed before the trial, the robot is assumed to have driven at that speed for "
        "this long: any lag has then settled.",
    )
    run_up_taken_s: float = setting(
        20.0,
        "s",
        "Seconds of commands before a piece of a long log that are included. Of 59 pieces with commands of 0.4 to 2 "
        "s at up to 0.2 m/s and an acceleration limit of 0.08 m/s^2, 8 begin with a wrong speed after 5 s, 1 after "
        "10 s, none after 20 s.",
    )
    run_up_step_s: float = setting(
        0.2,
        "s",
        "Longest step of the time grid before a trial: nothing is observed there, and effects are exact for "
        "constant commands.",
    )
