"""A body on joints held against cycles: each is simulated from where its markers were seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.cycles import CycleTracks, marker_noise_m, only_cycles
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.predict.base import Steps
from bns.diagnose.predict.responses import Responses
from bns.diagnose.settings import DEFAULTS
from bns.engine.pose_filter import displacements
from bns.errors import DataError
from bns.physics.effect import Effect
from bns.physics.jointed.drives import Drive, through_postures
from bns.physics.jointed.mechanism import Mechanism, machine
from bns.physics.jointed.model import JointedModel
from bns.physics.jointed.plant import Sighting
from bns.physics.jointed.simulate import Rest, Simulator
from bns.physics.model import ActiveEffect, Model
from bns.physics.signals import Body
from bns.robots.snake.gait import joint_angles
from bns.robots.snake.table import GAIT
from bns.sweep.jobs.cores import cores

_COARSER = DEFAULTS.predict.coarser
_SHARES = DEFAULTS.predict.response_shares
_LIGHT_SHARES = DEFAULTS.predict.screening_shares
_LIGHT = DEFAULTS.predict.screening_cycles
_WILD_M = DEFAULTS.predict.wild_m
_STILL_M = DEFAULTS.predict.still_m
COMMANDS = 13
"""Postures of a cycle, the first and the last the same."""
LUCK = (("floor-friction", "factor"), ("floor-slope", "east_rad"), ("floor-slope", "north_rad"))
"""What chance does to a cycle: a floor that is a little rougher here, or falls a little there; by the first node of each curve."""


class JointedPredictor:
    """Cycles of a robot on joints under any model of it; only stable ones, which the simulation can foresee, count.

    ``screening``: the same for some of the cycles, to see which effects are worth more; None: this is it.
    """

    horizons: tuple[str, ...] = ("cycle",)
    near = "cycle"

    def __init__(self, tracks: CycleTracks, model: JointedModel) -> None:
        cycles, bare = _Cycles.of(tracks, model.mechanism), replace(model, effects=())
        self._setup(cycles, bare, Responses(cycles.seen, bare, cycles.exactly, _SHARES))
        wild = self._luck_m() > _WILD_M
        self.left_out = int(wild.sum())
        """Cycles that nobody can foresee: a little luck moves them far."""
        if wild.any():
            kept = np.flatnonzero(~wild)
            cycles = cycles.only(kept)
            self._setup(cycles, bare, self._responses.only(_frames_of(kept), cycles.seen))
        every = max(len(self._cycles) // _LIGHT, 1)
        self.screening: JointedPredictor | None = None
        if every > 1:
            self.screening = _light(self, np.arange(every // 2, len(self._cycles), every))

    def _setup(self, cycles: _Cycles, bare: JointedModel, responses: Responses) -> None:
        self._cycles, self._bare, self._responses = cycles, bare, responses
        self.tracks: Tracks = cycles.tracks
        marker_m = marker_noise_m(cycles.tracks)
        gap = cycles.tracks.gap_m
        self.tracking: tuple[float, float] | None = None
        self.counted: Array | None = None
        if marker_m is not None:
            self.tracking = marker_m / np.sqrt(2), marker_m * np.sqrt(2) / float(np.median(gap))
        self._at = np.arange(len(self.tracks.t_s)) - self.tracks.first[:-1][self.tracks.trial]
        self._step_s = self._on_grid(np.diff(self.tracks.t_s, append=self.tracks.t_s[-1]), fill=0.0)
        self.way_m = np.where(self.tracks.is_first, 0.0, np.repeat(self._luck_m() ** 2 / _STILL_M + _STILL_M, 2))

    def anchor(self, model: Model) -> None:
        """Simulate this model itself: later answers nearby start from it."""
        self._responses.anchor(model)

    def steps(self, model: Model) -> Steps:
        """What the body does in each cycle, and how far the distances of its markers are off."""
        points = self._sighted(model).point_m
        line = points[:, -1] - points[:, 0]
        poses = np.column_stack([points.mean(axis=1), np.arctan2(line[:, 1], line[:, 0])])
        body = displacements(poses, self.tracks.is_first)
        body[:, 2] = (body[:, 2] + np.pi) % (2 * np.pi) - np.pi
        apart = self._cycles.tracks.gap_m - np.hypot(line[:, 0], line[:, 1])
        return Steps(self._with_velocities(body, model), np.zeros((len(body), 2)), apart[:, None])

    def windows(self, horizon: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Begins and ends of cycles."""
        begins = np.arange(0, len(self.tracks.t_s), 2)
        return begins, begins + 1

    def variables(self) -> dict[str, Array]:
        """What was driven, and where the robot was."""
        tracks = self._cycles.tracks
        values = {name: np.repeat(tracks.gait[:, i], 2) for i, name in enumerate(GAIT)}
        values["cycle"] = np.repeat(tracks.number.astype(float), 2)
        values |= {"x_m": tracks.pose[:, 0], "y_m": tracks.pose[:, 1], "heading_rad": tracks.pose[:, 2]}
        return {name: self._on_grid(v) for name, v in values.items()}

    def at_frames(self, frames: NDArray[np.int64]) -> dict[str, Array]:
        """`variables` of the cycles that begin at some frames."""
        last = self._step_s.shape[1] - 1
        rows, steps = self.tracks.trial[frames], np.minimum(self._at[frames], last)
        return {name: values[rows, steps] for name, values in self.variables().items()}

    def scores(self) -> Mapping[str, Mapping[str, float]]:
        """A body has but a path."""
        return {}

    def _sighted(self, model: Model) -> Sighting:
        seen = self._responses.seen(model)
        sighting = Sighting(seen[:, :, 0], seen[:, :, 1], seen[:, :, 2])
        for active in model.at("sight"):
            sighting = active.effect.apply(sighting, **active.by_name)
        return sighting

    def _with_velocities(self, body: Array, model: Model) -> Array:
        """Displacements (frames, 3) with what effects of the stage ``body`` (decoys, free curves) make of their velocities."""
        if not any(model.at("body")):
            return body
        lasting = np.maximum(self._step_s, 1e-9)
        to = np.minimum(np.arange(len(body)) + 1, len(body) - 1)
        rates = [self._on_grid(body[to, i] * sign) / lasting for i, sign in ((0, 1.0), (1, -1.0), (2, 1.0))]
        moving = (self._step_s > 0).astype(float)
        session = self.tracks.start_s[:, None] + np.cumsum(self._step_s, axis=1)
        state = Body(rates[0], rates[1], rates[2], moving, rates[0], rates[0], session)
        for active in model.at("body"):
            state = active.effect.apply(state, **active.by_name)
        ways = np.stack([state.forward_m_s, -state.sideways_m_s, state.yaw_rad_s], axis=2) * self._step_s[..., None]
        out = ways[self.tracks.trial, np.maximum(self._at - 1, 0)]
        out[self.tracks.is_first] = 0.0
        return out

    def _luck_m(self) -> Array:
        """How far a little luck moves each cycle's end, (cycles,)."""
        square = np.zeros(len(self._cycles))
        before = self.steps(self._bare).body[1::2]
        for name, parameter in LUCK:
            moved = self.steps(_a_little(self._bare, self._bare.effect_named(name), parameter)).body[1::2] - before
            half = float(np.median(self._cycles.tracks.gap_m)) / 2
            square += moved[:, 0] ** 2 + moved[:, 1] ** 2 + (half * moved[:, 2]) ** 2
        return np.sqrt(square)

    def _on_grid(self, values: Array, fill: float | None = None) -> Array:
        """Values (frames,) at the frame that begins each step, (trials, steps); padded with each trial's last, or ``fill``."""
        first = self.tracks.first
        width = int(np.diff(first).max()) - 1
        rows = []
        for a, b in pairwise(first):
            short = width - (b - 1 - a)
            rows.append(np.concatenate([values[a : b - 1], np.full(short, values[b - 2] if fill is None else fill)]))
        return np.array(rows)


def _light(whole: JointedPredictor, chosen: NDArray[np.int64]) -> JointedPredictor:
    light = object.__new__(JointedPredictor)
    light.left_out, light.screening = 0, None
    cycles = whole._cycles.only(chosen)
    light._setup(cycles, whole._bare, Responses(cycles.seen, whole._bare, cycles.exactly, _LIGHT_SHARES))
    return light


def _a_little(bare: JointedModel, effect: Effect, parameter: str) -> Model:
    """The model with one number of an effect at the first node of its curve."""
    p = next(p for p in effect.parameters if p.name == parameter)
    value = p.neutral + _SHARES[0] * (p.plausible[1] - p.neutral)
    return replace(bare, effects=(ActiveEffect(effect, tuple(value if q is p else q.neutral for q in effect.parameters)),))


def _frames_of(cycles: NDArray[np.int64]) -> NDArray[np.int64]:
    out: NDArray[np.int64] = np.repeat(2 * cycles, 2) + np.tile([0, 1], len(cycles))
    return out


class _Cycles:
    """Chosen cycles and their simulations, fine and coarse."""

    def __init__(self, tracks: CycleTracks, fine: Simulator, coarse: Simulator, rests: tuple[Rest, Rest], exactly: Array) -> None:
        self.tracks, self._fine, self._coarse, self._rests, self.exactly = tracks, fine, coarse, rests, exactly

    @classmethod
    def of(cls, tracks: CycleTracks, mechanism: Mechanism) -> _Cycles:
        chosen = np.flatnonzero(tracks.stable)
        if not len(chosen):
            raise DataError("No cycle is stable, and only stable ones are compared with a simulated body.")
        fine_s = float(machine(mechanism).model.opt.timestep)
        sims = [_simulator(mechanism, tracks, chosen, dt_s) for dt_s in (fine_s, _COARSER * fine_s)]
        rests = sims[0].at_rest(), sims[1].at_rest()
        exactly = _stacked(sims[0].sightings(sims[0].machine.plant, rests[0]))
        return cls(only_cycles(tracks, chosen), sims[0], sims[1], rests, exactly)

    def __len__(self) -> int:
        return len(self.tracks.gait)

    def only(self, chosen: NDArray[np.int64]) -> _Cycles:
        """Some of the cycles."""
        part = partial(_part, chosen)
        rests = self._rests[0].only(chosen), self._rests[1].only(chosen)
        exactly = self.exactly[_frames_of(chosen)]
        return _Cycles(only_cycles(self.tracks, chosen), part(self._fine), part(self._coarse), rests, exactly)

    def seen(self, model: Model) -> Array:
        """What is seen of a model, simulated coarsely; (frames, sites, 3, 2)."""
        assert isinstance(model, JointedModel)
        return _stacked(self._coarse.sightings(model.plant, self._rests[1]))


def _part(chosen: NDArray[np.int64], whole: Simulator) -> Simulator:
    return Simulator(whole.machine, [whole.drives[i] for i in chosen], cores())


def _stacked(s: Sighting) -> Array:
    return np.stack([s.point_m, s.along, s.left], axis=2)


def _simulator(mechanism: Mechanism, tracks: CycleTracks, chosen: NDArray[np.int64], dt_s: float) -> Simulator:
    body = machine(mechanism, dt_s)
    return Simulator(body, [_drive(mechanism, tracks, int(c), len(body.joints), dt_s) for c in chosen], cores())


def _drive(mechanism: Mechanism, tracks: CycleTracks, cycle: int, joints: int, dt_s: float) -> Drive:
    """The way to a cycle's first posture, from where the one before it ended, and the cycle."""
    t, gait, number = np.arange(COMMANDS), tracks.gait, tracks.number
    angles = joint_angles(gait[cycle], t, joints)
    begins = 2 * cycle in tracks.first
    if not begins and number[cycle] == number[cycle - 1] + 1:
        before = joint_angles(gait[cycle - 1], t[-1:], joints)
    else:
        before = np.zeros((1, joints)) if number[cycle] == 1 else angles[:1]
    return through_postures(mechanism, np.vstack([before, angles]), dt_s, tracks.pose[2 * cycle])
