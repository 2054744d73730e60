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
        "How fast an event fades in the variables that say what has just happened: soon it does nothing any more; "
        f"{BY_HAND}.",
    )
    coarse_s: float = setting(
        0.1, "s", f"Longest step of the grid in a search over many poses that were thinned out, for speed; {BY_HAND}."
    )
    picture_rounds: int = setting(
        3,
        "rounds",
        "Rounds in which a place in the picture is traced back to the floor: each leaves a power of the distortion.",
    )
    tail_s: float = setting(
        1.0, "s", "What the last row says, a command or none, is in force this long: poses may be stamped early."
    )
    network_near_s: float = setting(
        0.06, "s", f"A pose tracked this near the end of a command stands for it; {BY_HAND}."
    )
    middle_cycles: int = setting(3, "cycles", f"Cycles of the middle horizon; {BY_HAND}.")
    fewest_cycles: int = setting(3, "cycles", f"Of fewer cycles no accuracy and no tracking noise is told; {BY_HAND}.")
    marker_least_m: float = setting(
        1e-4, "m", f"No camera is taken to see a marker better than to a tenth of a millimetre; {BY_HAND}."
    )
    coarser: float = setting(
        2.0,
        "1",
        "Steps of a body's simulation are so many times as long where only the difference of two models counts: half the time; "
        f"a cycle then ends 3 mm elsewhere at the median, in both models alike; {BY_HAND}.",
    )
    response_shares: tuple[float, ...] = setting(
        (0.2, 0.6, 1.2),
        "1",
        f"Nodes of a response curve of a body: these shares of the way from neutral to what is plausible; {BY_HAND}.",
    )
    screening_shares: tuple[float, ...] = setting(
        (0.6, 1.2), "1", f"The same where effects are only screened: one node a side does; {BY_HAND}."
    )
    response_clipped_m: float = setting(
        0.5,
        "m",
        f"A response that moves a point farther than this is a robot that rolled over: it counts as this far; {BY_HAND}.",
    )
    anchor_near: float = setting(
        0.03,
        "1",
        f"A model this near to a simulated one (sum over its numbers, in plausible ranges) is not simulated again; {BY_HAND}.",
    )
    node_long: float = setting(
        0.15,
        "1",
        "Where numbers are settled, stretches between nodes that are longer than this share of what is plausible are halved: an "
        "arm's servo at half its strength was read as 0.40 between nodes at 0.4 and 0.8, and a second effect made up for it.",
    )
    node_beside: float = setting(
        0.3,
        "1",
        "Those too that a number lies next to, by this share of `node_long`: fits stop at the bends of a curve; "
        f"{BY_HAND}.",
    )
    screening_cycles: int = setting(64, "cycles", f"So many cycles, evenly chosen, screen the effects of a body; {BY_HAND}.")
    most_stretches: int = setting(
        200,
        "stretches",
        "Of more cycles or stretches of a body so many are simulated, evenly chosen: each costs 26 ms of a core a model, and a "
        "diagnosis asks for some 60 models.",
    )
    look_s: float = setting(
        0.04, "s", f"A simulated body is looked at this often; what a camera sees in between lies on the chord; {BY_HAND}."
    )
    wild_m: float = setting(
        0.03,
        "m",
        "Cycles that a little luck (friction 30 % higher, a floor that falls 0.7 degrees) moves farther than this cannot be "
        "foreseen and are left out: with 0.06 a friction that was plain by likelihood was withdrawn, for few wild cycles decide "
        "a root mean square.",
    )
    luck_friction: float = setting(
        0.1,
        "1",
        "A floor is usually rougher or smoother by this share from stretch to stretch, and under one link than under another: "
        "dust and wear. How much it really is, is estimated; this is where that begins.",
    )
    luck_slope_rad: float = setting(
        8e-3, "rad", "And falls by this, along x and along y: laboratory floors are level to within some centimetres a metre."
    )
    luck_draws: int = setting(
        3,
        "draws",
        f"Uneven links are drawn so often, each a direction of its own; each costs a simulation of all stretches; {BY_HAND}.",
    )
    luck_seed: int = setting(20_270_101, "1", "A fixed key: the same tracks have the same luck. Any number would do.")
    still_m: float = setting(
        5e-3, "m", f"Cycles that a little luck moves less far than this scatter alike; {BY_HAND}."
    )
    interval_draws: int = setting(
        1000, "samples", "Bootstrap samples: the ends of a 95 % interval are then known to 10 % of its width."
    )
    interval_fewest_trials: int = setting(
        5, "trials", "Fewer trials give no interval: a bootstrap of four has 35 different samples."
    )
    interval_seed: int = setting(
        20_260_101, "1", "A fixed key: the same data have the same interval. Any number would do."
    )
    robot_factor: float = setting(
        3.0,
        "1",
        "Skid-steered robots turn as if their wheels stood up to twice as far apart; beyond that it is another robot, or units.",
    )
    robot_explained: float = setting(
        0.25,
        "1",
        f"Another robot it is if turns that are scaled leave less than this share of the deviation; {BY_HAND}.",
    )
    robot_fewest: int = setting(5, "windows", f"Fewer windows of one second say nothing of the robot; {BY_HAND}.")
    robot_clear_m: float = setting(
        0.02, "m", f"Windows in which it was driven less far say nothing of its direction; {BY_HAND}."
    )
    robot_arc_rad: float = setting(
        1.2, "rad", f"Turns that a model says are smaller can be told from one more round; {BY_HAND}."
    )
    robot_together: float = setting(
        0.8, "1", f"Directions agree if the length of their mean is larger (1: all the same); {BY_HAND}."
    )
    robot_turned_rad: float = setting(
        1.05,
        "rad",
        "A camera that is askew by less (60 degrees) is an effect, `camera-rotation`, and no mistaken frame.",
    )
