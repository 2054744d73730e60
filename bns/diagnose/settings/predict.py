"""Settings of predictions, of the errors shown, and of the check that the model is one of this robot."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Predict:
    """``predict/``: wheels, networks, horizons, paired errors, the check of the robot."""

    horizons_s: tuple[tuple[str, float], ...] = setting(
        (("1s", 1.0), ("5s", 5.0)),
        "name, s",
        f"Horizons between one command and the whole trial: a convention of the tables; {BY_HAND}.",
    )
    recent_s: float = setting(
        0.15,
        "s",
        f"Decay time of the variables that describe recent events: later, an event has no more influence; {BY_HAND}.",
    )
    coarse_s: float = setting(
        0.1, "s", f"Longest step of the time grid in a search over a subset of many poses, for speed; {BY_HAND}."
    )
    picture_rounds: int = setting(
        8,
        "rounds",
        "Largest number of Newton's steps in which a pose in the picture is traced back to the floor. With three plain "
        "repetitions instead, a tilt that shrinks lengths by 7 % per metre was estimated 1.2 % too strong.",
    )
    picture_near: float = setting(
        3e-3,
        "m, rad",
        "A pose that a step moved by less is found: the next step, which goes by the square of this one, would move it by "
        f"some micrometres; {BY_HAND}.",
    )
    picture_aside: float = setting(
        1e-4, "m, rad", f"Distance over which the slopes of a picture are computed: small against any distortion; {BY_HAND}."
    )
    picture_least_area: float = setting(
        0.1, "1", f"A picture that makes less of an area than this fraction folds the floor, and is not traced back; {BY_HAND}."
    )
    tail_s: float = setting(
        1.0,
        "s",
        "The last row, a command or none, stays in force this long, because time stamps of poses may be early.",
    )
    network_near_s: float = setting(
        0.06, "s", f"A pose tracked within this time of the end of a command counts as the pose at its end; {BY_HAND}."
    )
    middle_cycles: int = setting(3, "cycles", f"Cycles of the middle horizon; {BY_HAND}.")
    fewest_cycles: int = setting(
        3, "cycles", f"With fewer cycles, neither accuracy nor tracking noise is reported; {BY_HAND}."
    )
    marker_least_m: float = setting(
        1e-4, "m", f"No camera is assumed to locate a marker better than to a tenth of a millimetre; {BY_HAND}."
    )
    coarser: float = setting(
        2.0,
        "1",
        "Where only the difference between two models counts, the steps of a body's simulation are this many times "
        f"as long. This halves the time; a cycle then ends 3 mm elsewhere (median), in both models alike; {BY_HAND}.",
    )
    response_shares: tuple[float, ...] = setting(
        (0.2, 0.6, 1.2),
        "1",
        "Nodes of a body's response curve: fractions of the distance from the neutral value to the end of the "
        f"plausible range; {BY_HAND}.",
    )
    response_clipped_m: float = setting(
        0.5,
        "m",
        "If a response moves a point further than this, the robot has rolled over; the response is limited to this "
        f"distance; {BY_HAND}.",
    )
    anchor_near: float = setting(
        0.01,
        "1",
        "A model is not simulated again if it is this close to a simulated one (sum over its parameters, in units "
        "of their plausible ranges, of factors by ratio). With 0.03, a stiffness of 0.7 was estimated as 0.76: between simulated "
        "values, the loss was too high by up to a third.",
    )
    node_near: float = setting(
        0.05,
        "1",
        "Where parameters are determined, the response is simulated this far to either side, in the same unit, unless it is "
        "known at a distance of half to one and a half times as much: fits stop at the bends of a curve, and a friction of 1.6 "
        "beside a joint zero was estimated as 1.46, next to a node at 1.467.",
    )
    screening_cycles: tuple[int, ...] = setting(
        (64, 21),
        "cycles",
        "Number of evenly spaced cycles with which the effects of a body are screened; and of those with which all are screened "
        f"first, after which the worse ones are dropped (`screen_first`); {BY_HAND}.",
    )
    most_stretches: int = setting(
        200,
        "stretches",
        "At most this many evenly spaced cycles or stretches of a body are simulated: each takes 26 ms of one core "
        "per model, and a diagnosis needs some 60 models.",
    )
    look_s: float = setting(
        0.02,
        "s",
        "Longest time between the recorded states of a simulated body, which is also recorded in the two steps beside each "
        "camera frame; frames lie on a cubic through four states. On straight lines through states 0.04 s apart, an arm's own "
        "simulation, seen at 30 Hz, moved 0.4 % too far; on cubics through states this far apart, by less than 0.07 % of the "
        "loss under a noise of 0.05 mm.",
    )
    run_up_longest_s: float = setting(
        8.0,
        "s",
        "What a body's servos were told before a stretch is simulated over at most this time. Beginning from 2 s, the time is "
        "doubled as long as that halves what shows of the posture in which it begins.",
    )
    run_up_shows_m: float = setting(
        1e-4,
        "m",
        "A run-up is long enough if one of twice its length ends no further than this from it (root mean square over stretches). "
        "Of an arm with servos of 6 N m/rad, a run-up of 2 s ended 45 mm away in one stretch of 24 and up to 5 mm in others.",
    )
    run_up_stretches: int = setting(
        24,
        "stretches",
        f"With at most this many evenly spaced stretches it is found how long a run-up is needed; {BY_HAND}.",
    )
    began_near: float = setting(
        0.1,
        "1",
        "A trial of a body is taken to begin at rest if its first pose is nearer to the model's own posture, or to that of its "
        f"first set points, than this share of what poses usually differ by; {BY_HAND}.",
    )
    wild_m: float = setting(
        0.03,
        "m",
        "Cycles that a small disturbance (friction 30 % higher, a floor slope of 0.7 degrees) moves further than "
        "this cannot be predicted and are excluded. With 0.06 m, an effect of friction with a clear likelihood was "
        "withdrawn, because a few such cycles dominate a root mean square.",
    )
    luck_friction: float = setting(
        0.1,
        "1",
        "Assumed relative variation of the floor friction from stretch to stretch and from link to link, caused by "
        "dust and wear. It is the start value; the actual variation is estimated.",
    )
    luck_slope_rad: float = setting(
        8e-3,
        "rad",
        "Assumed variation of the floor slope along x and along y: laboratory floors are level to within a few "
        "centimetres per metre.",
    )
    luck_draws: int = setting(
        3,
        "draws",
        "Number of random patterns of uneven links, each a direction of scatter of its own; each costs a simulation "
        f"of all stretches; {BY_HAND}.",
    )
    luck_seed: int = setting(
        20_270_101, "1", "A fixed key, so that the same tracks get the same random disturbances. Any number would do."
    )
    still_m: float = setting(
        5e-3,
        "m",
        f"Cycles that a small disturbance moves less than this are treated as having the same scatter; {BY_HAND}.",
    )
    interval_draws: int = setting(
        1000, "samples", "Bootstrap samples: the ends of a 95 % interval are then known to 10 % of its width."
    )
    interval_fewest_trials: int = setting(
        5, "trials", "With fewer trials no interval is given: a bootstrap of four trials has only 35 different samples."
    )
    interval_seed: int = setting(
        20_260_101, "1", "A fixed key, so that the same data give the same interval. Any number would do."
    )
    robot_factor: float = setting(
        3.0,
        "1",
        "Skid-steered robots turn as if their wheelbase were up to twice as large; beyond this factor, the model is "
        "of another robot or the units are wrong.",
    )
    robot_as_far: float = setting(
        1.25,
        "factor",
        "If a robot turns beyond that factor, and goes as far as it turns within this one, its speeds are in another unit: a "
        f"wheelbase alters turns alone; {BY_HAND}.",
    )
    robot_hint: float = setting(
        1.25,
        "1",
        "If the robot turns this many times as far as predicted, `compare` asks whether the wheelbase is right; "
        f"{BY_HAND}.",
    )
    robot_hint_explained: float = setting(
        0.5,
        "1",
        f"It asks if this factor reduces the deviation of turns to less than this fraction; {BY_HAND}.",
    )
    robot_explained: float = setting(
        0.25,
        "1",
        "The model is of another robot if a common factor on all its turns reduces the deviation to less than this "
        f"fraction; {BY_HAND}.",
    )
    robot_fewest: int = setting(
        5, "windows", f"With fewer windows of one second, the check of the robot is not made; {BY_HAND}."
    )
    robot_clear_m: float = setting(
        0.02, "m", f"Windows with a shorter driven distance say nothing of the robot's direction; {BY_HAND}."
    )
    robot_late: tuple[tuple[float, ...], int] = setting(
        ((0.0, 0.1, 0.2, 0.4, 0.7, 1.1, 1.6), 8),
        "s, rounds",
        "A wheelbase that the turns suggest counts what the robot was told to turn in each second and, by the first numbers, "
        "earlier, in so many rounds of weighted least squares. On 35 simulated robots of 0.05 to 1.5 m, lags and delays of up "
        "to 0.5 s it was at most 1 % off; counting the same second alone, up to 26 %.",
    )
    robot_arc_rad: float = setting(
        1.2,
        "rad",
        "Only windows in which the model turns by less than this are used: larger turns could be confused with turns "
        f"that have a further full revolution; {BY_HAND}.",
    )
    robot_together: float = setting(
        0.8, "1", f"Directions agree if the length of their mean vector is larger (1: all the same); {BY_HAND}."
    )
    robot_turned_rad: float = setting(
        1.05,
        "rad",
        "A camera frame that is rotated by less (60 degrees) is the effect `camera-rotation`, not a mistaken frame.",
    )
