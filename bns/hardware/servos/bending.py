"""A snake that bends to and fro, for its tracker's delay: how far its markers are apart, by its joints and as seen.

The joints between the markers that bend sideways go to one angle together and back, in steps of unequal lengths. However the
body slides meanwhile, the distance of its markers follows from its shape alone: links in a row, joints with their angles.
"""

from __future__ import annotations

import numpy as np

from bns.hardware.clock import Clock
from bns.hardware.delay import Motion, signed_steps
from bns.hardware.safety import Watch
from bns.hardware.servos.servo_chain import ServoChain, StrainWatch
from bns.hardware.servos.shape import apart_m
from bns.hardware.servos.snake_settings import SnakeSettings
from bns.hardware.tracking.eye import Eye
from bns.physics.snake.parameters import shipped_parameters

_LEAST_RAD, _MOST_RAD = 0.15, 0.6
"""Of one joint. Straighter than that, the markers hardly come nearer; four joints at the other end bend by 137 degrees."""
_LOOK_S = 0.01


def bent(chain: ServoChain, eye: Eye, watch: Watch, settings: SnakeSettings, clock: Clock, seconds: float) -> Motion:
    """Bend to and fro for so long, from a straight body with its torque on; whoever calls this stops the robot."""
    parameters = shipped_parameters()
    bending = np.zeros(len(settings.ids))
    bending[parameters.joints_between_markers] = 1.0
    bending[1::2] = 0.0  # those bend up and down
    robot: list[tuple[float, float]] = []
    seen: list[tuple[float, float]] = []
    strain = StrainWatch(settings.limits)
    began_s, next_s, steps = clock.now_s(), clock.now_s(), signed_steps()
    while clock.now_s() - began_s < seconds:
        if clock.now_s() >= next_s:
            side, lasts_s = next(steps)
            angle_rad = _MOST_RAD if side > 0 else _LEAST_RAD
            chain.move((angle_rad * bending).tolist(), [settings.joint_speed_rad_s] * len(bending))
            next_s += lasts_s
        asked_s = clock.now_s()
        healths = chain.health()
        robot.append(((asked_s + clock.now_s()) / 2.0, apart_m([h.position_rad for h in healths.values()], parameters)))
        strain.look(healths, clock.now_s())
        sight = eye.look()
        watch.check(sight, eye.picture_s)
        if sight is not None and (not seen or sight.t_s > seen[-1][0]):
            seen.append((sight.t_s, float(np.hypot(*(sight.points["green"] - sight.points["yellow"])))))
        clock.sleep(_LOOK_S)
    return Motion(*np.array(robot).T, *np.array(seen).reshape(-1, 2).T)

