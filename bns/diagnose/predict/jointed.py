"""A body on joints compared with tracks of its sites: every stretch is simulated from where the robot was seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.bodies.stretches import StretchTracks, apart, poses_of
from bns.diagnose.data.robust import robust_sd
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.predict.base import Predictor, Steps
from bns.diagnose.predict.luck import Luck, luck_of
from bns.diagnose.predict.responses import Responses
from bns.diagnose.predict.stretches import Simulations
from bns.diagnose.settings import DEFAULTS
from bns.engine.pose_filter import displacements
from bns.physics.applied import applied
from bns.physics.effect import Effect
from bns.physics.jointed.model import JointedModel
from bns.physics.jointed.plant import Plant, Sighting
from bns.physics.model import ActiveEffect, Model
from bns.physics.signals import Body
from bns.physics.wheels.differential_drive import taken_at

_SHARES = DEFAULTS.predict.response_shares
_LIGHT = DEFAULTS.predict.screening_cycles
_MOST = DEFAULTS.predict.most_stretches
_WILD_M = DEFAULTS.predict.wild_m
_MARKER_LEAST_M = DEFAULTS.predict.marker_least_m
_STILL_M = DEFAULTS.predict.still_m
_FRICTION = DEFAULTS.predict.luck_friction
_SLOPE_RAD = DEFAULTS.predict.luck_slope_rad
_DRAWS = DEFAULTS.predict.luck_draws
_LUCK_SEED = DEFAULTS.predict.luck_seed


@dataclass(frozen=True)
class _Piece:
    """Luck that is an effect, but small and another one in every stretch: how large it usually is."""

    effect: str
    parameter: str
    usual: float


LUCK = (
    (_Piece("floor-friction", "factor", _FRICTION),),
    (_Piece("floor-slope", "east_rad", _SLOPE_RAD), _Piece("floor-slope", "north_rad", _SLOPE_RAD)),
)
"""What chance does to a robot on a floor, by kind: a little rougher here, a little fall there."""


@dataclass(frozen=True)
class _Chance:
    """Luck of stretches, and how far a little of it moves each one's end (`_far_m`), (stretches,)."""

    luck: Luck
    far_m: Array

    def only(self, chosen: NDArray[np.int64], frames: NDArray[np.int64], tracks: StretchTracks) -> _Chance:
        """Of some stretches, those of ``tracks``."""
        return _Chance(self.luck.only(frames, tracks), self.far_m[chosen])


class JointedPredictor:
    """Stretches of a robot on joints under any model of it; only those that the simulation can foresee count.

    ``near``: what a stretch is called ("cycle", "stretch"). ``tracking_m``: noise of a tracked point's coordinate, where it is
    known. ``screening``: the same for some of the stretches, to see which effects are worth more; None: this is it.
    """

    counted: Array | None = None

    def __init__(
        self, tracks: StretchTracks, model: JointedModel, near: str = "cycle", tracking_m: float | None = None
    ) -> None:
        self.near, self._tracking_m = near, tracking_m
        self.horizons: tuple[str, ...] = (near,)
        there = len(tracks.told)
        if there > _MOST:
            tracks = tracks.of(np.unique(np.linspace(0, there - 1, _MOST).round().astype(np.int64)))
        self.not_taken = there - len(tracks.told)
        """Stretches that were left aside for speed: of very many, some evenly chosen ones are simulated."""
        simulations, bare = Simulations.of(tracks, model.mechanism), replace(model, effects=())
        far_m = _far_m(simulations, bare)
        wild = far_m > _WILD_M
        self.left_out = int(wild.sum())
        """Stretches that nobody can foresee: a little luck moves the robot far."""
        self._all, self._kept = simulations, np.flatnonzero(~wild) if not wild.all() else np.arange(len(wild))
        if len(self._kept) < len(wild):
            simulations, far_m = simulations.only(self._kept), far_m[self._kept]
        self._exactly = simulations.exactly(bare)
        self._setup(simulations, bare)
        chance = _Chance(self._luck(), far_m)
        self._foresee(chance)
        self.screening: Predictor | None = self._light(chance, _LIGHT)

    @property
    def all_stretches(self) -> StretchTracks:
        """Those that count, and those that nobody can foresee."""
        return self._all.tracks

    def on_stretches_of(self, other: JointedPredictor) -> JointedPredictor:
        """This body, made of `all_stretches` of another one, on those that the other one counts."""
        if np.array_equal(self._kept, other._kept):
            return self
        new = object.__new__(JointedPredictor)
        new.near, new.horizons, new._tracking_m = self.near, self.horizons, self._tracking_m
        new.left_out, new.not_taken = other.left_out, other.not_taken
        new._all, new._kept = self._all, other._kept
        simulations = self._all.only(other._kept)
        new._exactly = simulations.exactly(self._bare)
        new._setup(simulations, self._bare)
        new._foresee(_Chance(new._luck(), _far_m(simulations, self._bare)))
        new.screening = None
        return new

    def _light(self, chance: _Chance, cycles: Sequence[int]) -> JointedPredictor:
        """The same for so many of the stretches, which in turn has the next fewer of its own for a first look."""
        there = len(self._simulations)
        chosen = np.unique(np.linspace(0, there - 1, min(cycles[0], there)).round().astype(np.int64))
        light = object.__new__(JointedPredictor)
        light.near, light.horizons, light._tracking_m = self.near, self.horizons, self._tracking_m
        light.left_out, light.not_taken = 0, 0
        light._exactly = self._exactly[self._simulations.looks_of(chosen)]
        light._setup(self._simulations.only(chosen), self._bare, finely=False)
        own = chance.only(chosen, self._frames_of(chosen), light._stretches)
        light._foresee(own)
        light.screening = light._light(own, cycles[1:]) if len(cycles) > 1 and len(chosen) > cycles[1] else None
        return light

    def _setup(self, simulations: Simulations, bare: JointedModel, finely: bool = True) -> None:
        self._simulations, self._bare = simulations, bare
        self._responses = Responses(simulations.seen, bare, self._exactly, _SHARES, simulations.exactly if finely else None)
        self._stretches = simulations.tracks
        self.tracks: Tracks = self._stretches
        self._measured_apart = apart(self._stretches.points_m)
        self.tracking = self._tracking()
        self._at = np.arange(len(self.tracks.t_s)) - self.tracks.first[:-1][self.tracks.trial]
        self._step_s = self._on_grid(np.diff(self.tracks.t_s, append=self.tracks.t_s[-1]), fill=0.0)

    def _tracking(self) -> tuple[float, float] | None:
        """Noise of a tracked pose where cycles end in the posture in which they began: by what their distances change, too."""
        if self._tracking_m is None or not self._measured_apart.shape[1]:
            return None
        gap = self._measured_apart[:, -1]
        off = gap - apart(self._tracked(self._responses.bare))[:, -1]
        begins, ends = self.windows(self.near)
        marker_m = min(self._tracking_m, max(float(robust_sd(off[ends] - off[begins])) / 2, _MARKER_LEAST_M))
        return marker_m / np.sqrt(2), marker_m * np.sqrt(2) / float(np.median(gap))

    def _foresee(self, chance: _Chance) -> None:
        """What chance does to these stretches."""
        self.luck: Luck | None = chance.luck
        scatter = (chance.far_m**2 / _STILL_M + _STILL_M) / (np.bincount(self._stretches.stretch) - 1)
        self.way_m = np.where(self.tracks.is_first, 0.0, scatter[self._stretches.stretch])

    def _frames_of(self, chosen: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.flatnonzero(np.isin(self._stretches.stretch, chosen))

    def anchor(self, model: Model, alone: bool = False) -> bool:
        """Simulate this model itself: later answers nearby start from it."""
        return self._responses.anchor(model, alone)

    def foresees(self, model: Model) -> bool:
        """Is it a model of this body, whatever its effects?"""
        return isinstance(model, JointedModel) and model.mechanism == self._bare.mechanism

    @property
    def told_rad_s(self) -> float:
        """The fastest that servos are told to move: what the limit of their speed is a share of."""
        return self._simulations.told_rad_s

    @property
    def sites(self) -> tuple[str, ...]:
        """Names of the tracked sites."""
        return self._bare.mechanism.sites

    def steps(self, model: Model) -> Steps:
        """What the body does from frame to frame, and how far the distances of its points are off."""
        points = self._points(model)
        body = displacements(poses_of(points), self.tracks.is_first)
        body[:, 2] = (body[:, 2] + np.pi) % (2 * np.pi) - np.pi
        off = self._measured_apart - apart(points) if self._measured_apart.shape[1] else None
        return Steps(self._with_velocities(body, model), np.zeros((len(body), 2)), off)

    def windows(self, horizon: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Begins and ends of stretches."""
        return self._stretches.begins, self._stretches.ends

    def variables(self) -> dict[str, Array]:
        """What was driven, and where the robot was."""
        values = {name: of[self._stretches.stretch] for name, of in self._stretches.about.items()}
        pose = self.tracks.pose
        values |= {"x_m": pose[:, 0], "y_m": pose[:, 1], "heading_rad": pose[:, 2]}
        return {name: self._on_grid(v) for name, v in values.items()}

    def at_frames(self, frames: NDArray[np.int64]) -> dict[str, Array]:
        """`variables` of the steps that begin at some frames."""
        last = self._step_s.shape[1] - 1
        rows, steps = self.tracks.trial[frames], np.minimum(self._at[frames], last)
        return {name: values[rows, steps] for name, values in self.variables().items()}

    def listed(self, name: str) -> Effect | None:
        """The effect of that name of the body's catalogue; None if it has none."""
        return self._bare.catalogue().get(name)

    def scores(self) -> Mapping[str, Mapping[str, float]]:
        """A body has but a path."""
        return {}

    def _points(self, model: Model) -> Array:
        """Tracked points (frames, sites, 2) at the times at which they were really seen."""
        seen = self._responses.seen(model)
        sighting = Sighting(seen[:, 0], seen[:, 1], seen[:, 2])
        for active in model.at("sight"):
            sighting = applied(active.effect, sighting, active.by_name)
        since = self._stretches.since_s
        if any(model.at("clock")):
            inner = np.isfinite(since) & (since > 0)
            began = np.where(inner, self.tracks.t_s - since, 0.0)
            taken = taken_at(model, np.where(inner, self.tracks.t_s, 0.0), self.tracks.trial)
            since = np.where(inner, taken - began, since)
        return self._simulations.at(sighting.point_m, since)

    def _with_velocities(self, body: Array, model: Model) -> Array:
        """Displacements (frames, 3) with what effects of the stage ``body`` (decoys, free curves) make of their velocities."""
        if not any(model.at("body")):
            return body
        lasting = np.maximum(self._step_s, 1e-9)
        to = np.minimum(np.arange(len(body)) + 1, len(body) - 1)
        rates = [self._on_grid(body[to, i] * sign) / lasting for i, sign in ((0, 1.0), (1, -1.0), (2, 1.0))]
        moving = (self._step_s > 0).astype(float)
        session = self.tracks.start_s[:, None] + np.cumsum(self._step_s, axis=1)
        place = np.stack([self._on_grid(self.tracks.pose[:, i]) for i in range(3)], axis=2)
        state = Body(rates[0], rates[1], rates[2], moving, rates[0], rates[0], session, place)
        for active in model.at("body"):
            state = applied(active.effect, state, active.by_name)
        ways = np.stack([state.forward_m_s, -state.sideways_m_s, state.yaw_rad_s], axis=2) * self._step_s[..., None]
        out = ways[self.tracks.trial, np.maximum(self._at - 1, 0)]
        out[self.tracks.is_first] = 0.0
        return out

    def _luck(self) -> Luck:
        """Each piece of luck simulated once: a rougher floor, floors that fall, uneven links, and steps half as long."""
        r, known = self._responses, self._bare.catalogue()
        usual, pieces = self._tracked(r.coarse), [[self._tracked(r.bare)]]
        for kind in LUCK if LUCK[0][0].effect in known else ():
            pieces.append([])
            for one in kind:
                near, there = _a_little(self._bare, known[one.effect], one.parameter)
                moved = self._tracked(self._simulations.seen(near)) - usual
                pieces[-1].append(usual + one.usual / there * moved)
        if len(pieces) > 1:
            uneven = [self._tracked(self._simulations.seen_of(plant)) for plant in _uneven(self._simulations.plant)]
            pieces.append([usual + (points - usual) / np.sqrt(len(uneven)) for points in uneven])
        return luck_of(self._stretches, usual, pieces)

    def _tracked(self, seen: Array) -> Array:
        """Tracked points (frames, sites, 2) of what was looked at."""
        return self._simulations.at(seen[:, 0], self._stretches.since_s)

    def _on_grid(self, values: Array, fill: float | None = None) -> Array:
        """Values (frames,) at the frame that begins each step, (trials, steps); padded with each trial's last, or ``fill``."""
        first = self.tracks.first
        width = int(np.diff(first).max()) - 1
        rows = []
        for a, b in pairwise(first):
            short = width - (b - 1 - a)
            rows.append(np.concatenate([values[a : b - 1], np.full(short, values[b - 2] if fill is None else fill)]))
        return np.array(rows)


def _far_m(simulations: Simulations, bare: JointedModel) -> Array:
    """How far the first nodes of the curves of `LUCK` move the end of each stretch, (stretches,)."""
    known, tracks, total = bare.catalogue(), simulations.tracks, np.zeros(len(simulations))
    usual = simulations.at(simulations.seen(bare)[:, 0], tracks.since_s)
    for one in (one for kind in LUCK for one in kind) if LUCK[0][0].effect in known else ():
        near, _ = _a_little(bare, known[one.effect], one.parameter)
        moved = simulations.at(simulations.seen(near)[:, 0], tracks.since_s) - usual
        total += ((moved[tracks.ends] - moved[tracks.begins]) ** 2).sum(axis=(1, 2)) / moved.shape[1]
    return np.asarray(np.sqrt(total))


def _a_little(bare: JointedModel, effect: Effect, parameter: str) -> tuple[Model, float]:
    """The model with one number of an effect at the first node of its curve, and how far from neutral that is."""
    p = next(p for p in effect.parameters if p.name == parameter)
    value = p.neutral + _SHARES[0] * (p.plausible[1] - p.neutral)
    values = tuple(value if q is p else q.neutral for q in effect.parameters)
    return replace(bare, effects=(ActiveEffect(effect, values),)), value - p.neutral


def _uneven(plant: Plant) -> list[Plant]:
    """Links that grip unevenly, by lot."""
    rng, links = np.random.default_rng(_LUCK_SEED), len(plant.grip)
    drawn = np.clip(1 + _FRICTION * rng.normal(size=(_DRAWS, links)), _FRICTION, None)
    return [replace(plant, grip=grip) for grip in drawn]
