"""Simulator networks of a robot that is driven in cycles, compared with measurements of its markers."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.bodies.cycles import CycleTracks, marker_noise_m
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.predict.base import Steps
from bns.diagnose.settings import DEFAULTS
from bns.engine.snn import predict
from bns.physics.applied import applied
from bns.physics.model import Model
from bns.physics.signals import Body
from bns.robots.simulator import StaticSimulator
from bns.robots.snake import path
from bns.robots.snake.robot import Snake
from bns.robots.snake.table import GAIT
from bns.static_simulator.train_in_stages import accuracy

SEVERAL = DEFAULTS.predict.middle_cycles
_FEW = DEFAULTS.predict.fewest_cycles


class CyclePredictor:
    """Networks asked for every cycle, from where its markers were seen; between two cycles, what the robot's options say:
    nothing, or what the change of posture does.

    A model handed to `steps` counts only by its effects, which come on top. Errors are those of stable cycles: the networks of
    displacements learn from no others.
    """

    horizons: tuple[str, ...] = ("cycle", "change", f"{SEVERAL} cycles", "trial")
    near = "cycle"
    screening = None

    def __init__(self, tracks: CycleTracks, saved: StaticSimulator, robot: Snake) -> None:
        self.tracks: Tracks = tracks
        self._cycles = tracks
        self._robot, self._names = robot, saved.networks
        commands = np.column_stack([tracks.gait, np.ones(len(tracks.gait))])
        outputs = predict(saved.weights, robot.inputs(commands), robot.sigmoid_output)
        self._moved = robot.displacements(outputs)
        self._changes = robot.changes(tracks.gait) if robot.with_changes else None
        self._networks = self._driven()
        self.tracking, self.counted, self.luck = self._tracking(), None, None
        self.way_m = np.hypot(*self._since_previous(tracks.pose)[:, :2].T)
        self._at = np.arange(len(tracks.t_s)) - tracks.first[:-1][tracks.trial]
        self._step_s = self._on_grid(np.diff(tracks.t_s, append=tracks.t_s[-1]), fill=0.0)

    def steps(self, model: Model) -> Steps:
        """What the networks predict for each cycle, and what the model's effects add over its time."""
        zero = np.zeros_like(self._step_s)
        body = Body(zero, zero, zero, (self._step_s > 0).astype(float), zero, zero, zero)
        for active in model.at("body"):
            body = applied(active.effect, body, active.by_name)
        rates = np.stack([body.forward_m_s, -body.sideways_m_s, body.yaw_rad_s], axis=2) * self._step_s[..., None]
        added = rates[self.tracks.trial, np.maximum(self._at - 1, 0)]
        added[self.tracks.is_first] = 0.0
        return Steps(self._networks + added, np.zeros((len(added), 2)))

    def anchor(self, model: Model, alone: bool = False) -> bool:
        """Every answer is exact."""
        return False

    def windows(self, horizon: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Begins and ends of stable cycles, of changes between two, of several in a row, of all a trial began with."""
        runs = [run for trial in range(len(self.tracks)) for run in self._stable_runs(trial)]
        if horizon == "cycle":
            pairs = [(2 * c, 2 * c + 1) for run in runs for c in run]
        elif horizon == "change":
            pairs = [(2 * c + 1, 2 * c + 2) for run in runs for c in run[:-1]]
        elif horizon == "trial":
            pairs = [(2 * run[0], 2 * run[-1] + 1) for run in runs if 2 * run[0] in self.tracks.first]
        else:
            pairs = [
                (2 * run[i], 2 * run[i + SEVERAL - 1] + 1)
                for run in runs
                for i in range(0, len(run) - SEVERAL + 1, SEVERAL)
            ]
        found = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        return found[:, 0], found[:, 1]

    def variables(self) -> dict[str, Array]:
        """What was driven and where the robot was; a change has the parameters of the cycle it leads to."""
        tracks = self._cycles
        new = np.repeat(np.arange(len(tracks.gait)), 2)
        to = np.minimum(new + np.tile([0, 1], len(tracks.gait)), len(tracks.gait) - 1)
        before = np.where(self._at == 0, to, to - 1)
        values = {name: tracks.gait[to, i] for i, name in enumerate(GAIT)}
        values |= {f"previous_{name}": tracks.gait[before, i] for i, name in enumerate(GAIT)}
        values["change"] = np.tile([0.0, 1.0], len(tracks.gait))
        values["cycle"] = tracks.number[to].astype(float)
        values |= {"x_m": tracks.pose[:, 0], "y_m": tracks.pose[:, 1], "heading_rad": tracks.pose[:, 2]}
        return {name: self._on_grid(v) for name, v in values.items()}

    def at_frames(self, frames: NDArray[np.int64]) -> dict[str, Array]:
        """`variables` of the cycle or change that begins at some frames."""
        last = self._step_s.shape[1] - 1
        return {
            n: v[self.tracks.trial[frames], np.minimum(self._at[frames], last)] for n, v in self.variables().items()
        }

    def scores(self) -> Mapping[str, Mapping[str, float]]:
        """R², regression, RMSE and bias (SI) of each network of displacements; of stability the shares it calls right."""
        tracks = self._cycles
        stable = tracks.stable.astype(float)
        seen = path.unwalk(np.column_stack([tracks.markers_m.reshape(-1, 8), stable]))
        learnable = self._robot.learnable(seen)
        out: dict[str, Mapping[str, float]] = {}
        for net, name in enumerate(self._names):
            kept = learnable[net]
            if name == "stable":
                out[name] = {
                    f"{kind}_called_right": float(((self._moved[of, net] >= 0.5) == (kind == "stable")).mean())
                    for kind, of in (("stable", tracks.stable), ("unstable", ~tracks.stable))
                    if of.any()
                }
            elif kept.sum() >= _FEW:
                out[name] = accuracy(seen[kept, net], self._moved[kept, net])
        return out

    def _tracking(self) -> tuple[float, float] | None:
        """A stable cycle ends in the posture in which it began: what its markers' distance differs by is the camera's noise."""
        marker_m = marker_noise_m(self._cycles)
        return None if marker_m is None else (marker_m / np.sqrt(2), marker_m * np.sqrt(2) / float(np.median(self._cycles.gap_m)))

    def gap_errors(self, horizon: str) -> Array:
        """Measured minus predicted distance of the markers at the ends of a horizon's windows, m, (windows,)."""
        starts, ends = self.windows(horizon)
        out = np.empty(len(starts))
        for i, (start, end) in enumerate(zip(starts, ends, strict=True)):
            markers = self._cycles.markers_m[start]
            for frame in range(start + 1, end + 1):
                markers = self._foreseen(frame, markers)
            line = self._cycles.markers_m[end, 1] - self._cycles.markers_m[end, 0]
            out[i] = np.hypot(*line) - np.hypot(*(markers[1] - markers[0]))
        return out

    def _foreseen(self, frame: int, markers: Array) -> Array:
        """Markers (2, 2) at a frame, from where they are at the one before: through a cycle, or through a change."""
        cycle, ends_cycle = divmod(frame, 2)
        if ends_cycle:
            gap = float(np.hypot(*(markers[1] - markers[0]))) if self._robot.rigid else None
            return path.moved_on(markers, self._moved[cycle], gap)
        if self._changes is None:
            return markers
        return path.moved_on(markers, self._changes[cycle], self._changes[cycle, 4] if self._robot.rigid else None)

    def _driven(self) -> Array:
        """Predicted displacement since the frame before, (frames, 3): along, to the left, turn; 0 at a change."""
        out = np.zeros((len(self.tracks.t_s), 3))
        for frame in np.flatnonzero(~self.tracks.is_first):
            before = self._cycles.markers_m[frame - 1]
            out[frame] = _pose_change(before, self._foreseen(int(frame), before))
        return out

    def _stable_runs(self, trial: int) -> list[list[int]]:
        """Stable cycles of a trial that follow one another without a gap."""
        runs: list[list[int]] = []
        for c in range(self.tracks.first[trial] // 2, self.tracks.first[trial + 1] // 2):
            if not self._cycles.stable[c]:
                continue
            if runs and runs[-1][-1] == c - 1 and self._cycles.number[c] == self._cycles.number[c - 1] + 1:
                runs[-1].append(c)
            else:
                runs.append([c])
        return runs

    def _since_previous(self, values: Array) -> Array:
        change = np.diff(values, axis=0, prepend=values[:1])
        change[self.tracks.is_first] = 0.0
        return change

    def _on_grid(self, values: Array, fill: float | None = None) -> Array:
        """Values (frames,) at the frame that begins each step, (trials, steps); padded with each trial's last, or ``fill``."""
        first = self.tracks.first
        width = int(np.diff(first).max()) - 1
        rows = []
        for a, b in pairwise(first):
            short = width - (b - 1 - a)
            rows.append(np.concatenate([values[a : b - 1], np.full(short, values[b - 2] if fill is None else fill)]))
        return np.array(rows)


def _pose_change(before: Array, after: Array) -> tuple[float, float, float]:
    """Way of the middle along and to the left of the markers' line (2, 2) before, m, and its turn, rad."""
    right, along = path.frame(before)
    way, line = (after - before).mean(axis=0), after[1] - after[0]
    return way @ along, -(way @ right), float(np.arctan2(-(line @ right), line @ along))
