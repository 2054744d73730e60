"""Stretches of a robot on joints, simulated: finely as the model is, coarsely where differences count."""

from __future__ import annotations

from dataclasses import dataclass, replace
from threading import RLock

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.bodies.stretches import StretchTracks
from bns.diagnose.data.tracks import Array
from bns.diagnose.settings import DEFAULTS
from bns.physics.jointed.drives import Drive
from bns.physics.jointed.mechanism import Mechanism, machine
from bns.physics.jointed.model import JointedModel
from bns.physics.jointed.plant import RIM_M, Plant, Rough, Sighting
from bns.physics.jointed.simulate import Rest, Simulator, joined, replace_state
from bns.physics.model import Model
from bns.sweep.jobs.cores import cores

_COARSER = DEFAULTS.predict.coarser
_LOOK_S = DEFAULTS.predict.look_s
Indices = NDArray[np.int64]
_RIMS = 5.0
"""So many widths of its rim from a disc, its friction is that of the floor within 1 %; links are noted in between, too."""


@dataclass(frozen=True)
class _Known:
    """What was simulated of a plant: looks of all stretches (looks, 3, sites, 2), and which stretches are done."""

    seen: Array
    done: NDArray[np.bool_]


class _Level:
    """All stretches in steps of one length. None is simulated twice with the same plant, whoever asks for it.

    ``first`` (stretches + 1,): where the looks of each begin.
    """

    def __init__(self, simulator: Simulator, first: NDArray[np.int64]) -> None:
        self.simulator, self.first = simulator, first
        self._known: dict[bytes, _Known] = {}
        self._rests: dict[int, Rest] = {}
        self._box_m: dict[int, Array] = {}
        self._lock = RLock()

    def looks_of(self, stretches: NDArray[np.int64]) -> NDArray[np.int64]:
        """The looks of some stretches."""
        return np.concatenate([np.arange(self.first[i], self.first[i + 1]) for i in stretches])

    def seen(self, plant: Plant, stretches: NDArray[np.int64]) -> Array:
        """What is seen of a plant in some stretches; (looks, 3, sites, 2)."""
        with self._lock:
            known = self._known.setdefault(plant.key, self._nothing())
            new = stretches[~known.done[stretches]]
            if len(new):
                known.seen[self.looks_of(new)] = self._simulated(plant, new)
                known.done[new] = True
            return known.seen[self.looks_of(stretches)]

    def _nothing(self) -> _Known:
        sites = len(self.simulator.machine.mechanism.sites)
        return _Known(np.zeros((self.first[-1], 3, sites, 2)), np.zeros(len(self.first) - 1, dtype=bool))

    def _simulated(self, plant: Plant, stretches: NDArray[np.int64]) -> Array:
        if plant.rough and replace(plant, rough=()).key == self.simulator.machine.plant.key:
            return self._on_rough(plant, stretches)
        return self._all_simulated(plant, stretches)

    def _on_rough(self, plant: Plant, stretches: NDArray[np.int64]) -> Array:
        """A floor that is level but for some places: stretches whose links come to none of them are as on a level one."""
        sound = self.simulator.machine.plant
        out = self.seen(sound, stretches)
        box_m = np.array([self._box_m[i] for i in stretches.tolist()])
        there = np.flatnonzero(np.any([_comes_near(place, box_m) for place in plant.rough], axis=0))
        if len(there):
            lengths = np.diff(self.first)[stretches]
            looks = np.flatnonzero(np.isin(np.repeat(np.arange(len(stretches)), lengths), there))
            out[looks] = self._all_simulated(plant, stretches[there])
        return out

    def _all_simulated(self, plant: Plant, stretches: NDArray[np.int64]) -> Array:
        simulator, rest = self.simulator.only(stretches), self._rest(stretches)
        held = (plant.friction_rad > 0).any() or (np.minimum(plant.stiffness, plant.torque) < 1).any()
        if held:  # a servo that gives no torque, or too little for the friction of its joint, did not bring it anywhere
            rest = replace_state(rest, simulator.settled(plant))
        out = _stacked(simulator.sightings(plant, rest))
        if plant.key == simulator.machine.plant.key:
            self._box_m |= dict(zip(stretches.tolist(), simulator.box_m, strict=True))
        return out

    def _rest(self, stretches: NDArray[np.int64]) -> Rest:
        """Where the sound body begins some stretches."""
        new = [i for i in stretches.tolist() if i not in self._rests]
        if new:
            found = self.simulator.only(np.array(new)).at_rest()
            self._rests |= {i: found.only(np.array([k])) for k, i in enumerate(new)}
        return joined([self._rests[i] for i in stretches.tolist()])


class _Body:
    """All stretches, in the model's own steps and in longer ones."""

    def __init__(self, tracks: StretchTracks, mechanism: Mechanism) -> None:
        fine_s = float(machine(mechanism).model.opt.timestep)
        looks_s = _looks(tracks, _COARSER * fine_s)
        simulators = [
            Simulator(machine(mechanism, dt_s), _drives(tracks, dt_s, looks_s), cores())
            for dt_s in (fine_s, _COARSER * fine_s)
        ]
        first = np.concatenate([[0], np.cumsum(simulators[0].counts)]).astype(np.int64)
        self.fine, self.coarse = (_Level(simulator, first) for simulator in simulators)
        self.plant = simulators[0].machine.plant


class Simulations:
    """Chosen stretches and their simulations.

    A body is looked at in a stretch's first and last frame, and where it was seen in between: in the two steps beside each frame,
    and else so often that a cubic does for other times, as a clock that is off has them. Chords would make its ways shorter: with
    looks 0.04 s apart, by half a percent of a quick arm's.
    """

    def __init__(self, body: _Body, tracks: StretchTracks, chosen: NDArray[np.int64]) -> None:
        self.tracks, self._body, self._chosen = tracks, body, chosen
        simulator = body.fine.simulator
        self._counts = simulator.counts[chosen]
        self._first = np.concatenate([[0], np.cumsum(self._counts)])
        step_s = float(simulator.machine.model.opt.timestep)
        drives = [simulator.drives[i] for i in chosen]
        self._look_s = np.concatenate([(d.frames - d.frames[0]) * step_s for d in drives])

    @classmethod
    def of(cls, tracks: StretchTracks, mechanism: Mechanism) -> Simulations:
        """All stretches of these tracks."""
        return cls(_Body(tracks, mechanism), tracks, np.arange(len(tracks.told)))

    def __len__(self) -> int:
        return len(self._chosen)

    def looks_of(self, chosen: NDArray[np.int64]) -> NDArray[np.int64]:
        """The looks of some stretches."""
        return np.concatenate([np.arange(self._first[i], self._first[i + 1]) for i in chosen])

    def only(self, chosen: NDArray[np.int64]) -> Simulations:
        """Some of the stretches."""
        return Simulations(self._body, self.tracks.of(chosen), self._chosen[chosen])

    def exactly(self, model: Model) -> Array:
        """What is seen of a model, simulated finely; (looks, 3, sites, 2)."""
        assert isinstance(model, JointedModel)
        return self._body.fine.seen(model.plant, self._chosen)

    def seen(self, model: Model) -> Array:
        """The same, simulated coarsely."""
        assert isinstance(model, JointedModel)
        return self.seen_of(model.plant)

    def seen_of(self, plant: Plant) -> Array:
        """The same of a plant."""
        return self._body.coarse.seen(plant, self._chosen)

    @property
    def plant(self) -> Plant:
        """The plant with nothing wrong."""
        return self._body.plant

    @property
    def told_rad_s(self) -> float:
        """The fastest that servos are told to move: the speed limit of one is a share of it."""
        return self._body.fine.simulator.told_rad_s

    def at(self, points_m: Array, since_s: Array) -> Array:
        """Points (frames, sites, 2) that were looked at (looks, sites, 2), at times since_s (frames,) of their stretches."""
        stretch = self.tracks.stretch
        first, last = self._first[stretch], self._first[stretch + 1] - 1
        since = np.clip(since_s, 0.0, self._look_s[last])
        # times of all stretches one after the other, so that one search finds all
        offset = np.concatenate([[0.0], np.cumsum(self._look_s[self._first[1:] - 1] + 1.0)])
        of_look = np.repeat(np.arange(len(self)), self._counts)
        at = np.searchsorted(self._look_s + offset[of_look], since + offset[stretch], side="right")
        return _between(points_m, self._look_s, since, np.clip(at, first + 1, last) - 1, first, last)


def _between(points_m: Array, look_s: Array, since_s: Array, lower: Indices, first: Indices, last: Indices) -> Array:
    """Points (frames, ...) at times since_s (frames,) from those of looks, points_m (looks, ...) at look_s (looks,).

    On the cubic through the two looks around each, ``lower`` (frames,) and the next, and one to either side; of fewer looks from
    ``first`` to ``last`` (frames,) on the curve through all.
    """
    begin = np.clip(lower - 1, first, np.maximum(last - 3, first))
    nodes = [np.minimum(begin + k, last) for k in range(4)]
    out = np.zeros((len(since_s), *points_m.shape[1:]))
    for k, node in enumerate(nodes):
        weight = np.where(begin + k <= last, 1.0, 0.0)
        for j, other in enumerate(nodes):
            if j != k:
                apart = np.where(begin + j <= last, look_s[node] - look_s[other], 1.0)
                away = np.where(begin + j <= last, since_s - look_s[other], 1.0)
                weight *= away / np.where(apart == 0.0, 1.0, apart)
        out += weight.reshape(-1, *(1,) * (points_m.ndim - 1)) * points_m[node]
    return out


def _comes_near(place: Rough, box_m: Array) -> NDArray[np.bool_]:
    """Do links that stay in boxes (stretches, 4) come to a place of the floor? (stretches,)."""
    reach = place.reach_m + _RIMS * RIM_M
    low, high = np.array([place.x_m, place.y_m]) - reach, np.array([place.x_m, place.y_m]) + reach
    return np.asarray(((box_m[:, :2] < high) & (box_m[:, 2:] > low)).all(axis=1))


def _looks(tracks: StretchTracks, step_s: float) -> list[Array]:
    """When each stretch is looked at, since its begin: at its ends; if it was seen in between, evenly and beside each frame."""
    bounds = np.searchsorted(tracks.stretch, np.arange(len(tracks.told) + 1))
    out = []
    for told, begin, i, k in zip(tracks.told, tracks.begins, bounds[:-1], bounds[1:], strict=True):
        ends = told.drive(step_s, tracks.pose[begin], 2).frames
        last = int(ends[-1] - ends[0])
        steps = np.array([0, last])
        if k - i > 2:
            evenly = np.linspace(0, last, max(int(np.ceil(last * step_s / _LOOK_S)), 1) + 1).round()
            since_s = tracks.since_s[i:k]
            before = np.floor(since_s[np.isfinite(since_s)] / step_s)
            steps = np.unique(np.clip(np.concatenate([evenly, before, before + 1]), 0, last))
        out.append(steps * step_s)
    return out


def _drives(tracks: StretchTracks, dt_s: float, looks_s: list[Array]) -> list[Drive]:
    return [
        _looked_at(told.drive(dt_s, tracks.pose[begin], 2), look_s, dt_s)
        for told, begin, look_s in zip(tracks.told, tracks.begins, looks_s, strict=True)
    ]


def _looked_at(drive: Drive, look_s: Array, dt_s: float) -> Drive:
    """The same, looked at in the steps next to these times since its begin (looks,), and in its last."""
    first, last = int(drive.frames[0]), int(drive.frames[-1])
    frames = np.minimum(first + np.round(look_s / dt_s).astype(np.int64), last)
    frames[-1] = last
    return replace(drive, frames=frames)


def _stacked(s: Sighting) -> Array:
    return np.stack([s.point_m, s.along, s.left], axis=1)
