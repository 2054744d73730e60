"""A run's simulator networks as a model that is compared with measurements.

Networks predict a whole command at once, so the tracks are looked at where commands begin and end.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.predict.base import Steps
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.settings import DEFAULTS
from bns.engine.pose_filter import displacements
from bns.engine.snn import predict
from bns.errors import DataError
from bns.physics.model import Model
from bns.robots.base import Robot
from bns.robots.simulator import StaticSimulator

_NEAR_S = DEFAULTS.predict.network_near_s


class NetworkPredictor(WheelPredictor):
    """Networks of a differential drive, asked for every command.

    A model handed to `steps` counts only by its effects, which come on top: so the free curves of `structure` say where
    networks fail.
    DataError if no pose was tracked at the ends of commands.
    """

    def __init__(self, tracks: Tracks, saved: StaticSimulator, robot: Robot) -> None:
        self._robot = robot
        nodes = _command_ends(tracks)
        super().__init__(_only_frames(tracks, nodes >= 0))
        if len(self.tracks.t_s) < 2 * len(self.tracks):
            raise DataError("Networks predict whole commands, but no pose was tracked near the ends of commands.")
        self._bare = Model(wheelbase_m=1.0)
        self.node = nodes[nodes >= 0]
        """How many commands had ended at each frame, (frames,)."""
        self.learned_from = saved.learned_from
        self._networks = self._by_networks(saved, self.node)

    @property
    def robot(self) -> Robot:
        """The robot whose networks these are."""
        return self._robot

    def commands(self, trial: int) -> Array:
        """Commands of a trial in the robot's own units, (commands, 3)."""
        tracks = self.tracks
        lasting = tracks.duration_s[trial] > 0
        speeds = np.column_stack([tracks.left_m_s[trial], tracks.right_m_s[trial]])[lasting]
        unit = self._robot.wheel_speeds_m_s(np.ones((1, 3)))  # type: ignore[attr-defined]  # of a differential drive
        return np.column_stack(
            [speeds[:, 0] / unit[0], speeds[:, 1] / unit[1], tracks.duration_s[trial][lasting] / unit[2]]
        )

    def measured(self) -> Array:
        """As the networks' own steps: forward, left and turn since the frame before as tracked, (frames, 3)."""
        seen, told = displacements(self.tracks.pose, self.tracks.is_first), self._networks
        turn = told[:, 2] + (seen[:, 2] - told[:, 2] + np.pi) % (2 * np.pi) - np.pi
        return np.column_stack([seen[:, :2], turn])

    def steps(self, model: Model) -> Steps:
        """What the networks predict between the ends of commands, and what the model's effects add to it."""
        plain = replace(model, effects=())
        with_effects, without = super().steps(model), super().steps(plain)
        return Steps(self._networks + with_effects.body - without.body, with_effects.drift_m - without.drift_m)

    def _by_networks(self, saved: StaticSimulator, nodes: NDArray[np.int64]) -> Array:
        """Displacement since the frame before, (frames, 3): forward, left, turn."""
        tracks, poses = self.tracks, np.empty((len(nodes), 3))
        for trial in range(len(tracks)):
            frames = slice(tracks.first[trial], tracks.first[trial + 1])
            poses[frames] = self._path(saved, trial)[nodes[frames]]
        return displacements(poses, self.tracks.is_first)

    def _path(self, saved: StaticSimulator, trial: int) -> Array:
        """Pose at the begin and after every command of a trial, (commands + 1, 3)."""
        commands = self.commands(trial)
        displaced = self._robot.displacements(predict(saved.weights, self._robot.inputs(commands)))
        return np.vstack([self._robot.start_pose(), self._robot.poses(displaced, commands)])


def _command_ends(tracks: Tracks) -> NDArray[np.int64]:
    """Which command's end each frame stands for (0: the begin of the trial), -1 for none; (frames,)."""
    out = np.full(len(tracks.t_s), -1, dtype=np.int64)
    for trial in range(len(tracks)):
        frames = np.arange(tracks.first[trial], tracks.first[trial + 1])
        lasting = tracks.duration_s[trial][tracks.duration_s[trial] > 0]
        for node, end in enumerate(np.concatenate([[0.0], np.cumsum(lasting)])):
            if len(frames):
                nearest = frames[np.argmin(np.abs(tracks.t_s[frames] - end))]
                if abs(tracks.t_s[nearest] - end) <= _NEAR_S and out[nearest] < 0:
                    out[nearest] = node
    return out


def _only_frames(tracks: Tracks, kept: NDArray[np.bool_]) -> Tracks:
    counts = np.add.reduceat(kept.astype(np.int64), tracks.first[:-1])
    return replace(
        tracks,
        first=np.concatenate([[0], np.cumsum(counts)]),
        t_s=tracks.t_s[kept],
        pose=tracks.pose[kept],
        extra={name: values[kept] for name, values in tracks.extra.items()},
    )
