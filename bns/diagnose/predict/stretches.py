"""Stretches of a robot on joints, simulated: finely as the model is, coarsely where differences count."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.bodies.stretches import StretchTracks
from bns.diagnose.data.tracks import Array
from bns.diagnose.settings import DEFAULTS
from bns.physics.jointed.drives import Drive
from bns.physics.jointed.mechanism import Mechanism, machine
from bns.physics.jointed.model import JointedModel
from bns.physics.jointed.plant import Plant, Sighting
from bns.physics.jointed.simulate import Rest, Simulator, replace_state
from bns.physics.model import Model
from bns.sweep.jobs.cores import cores

_COARSER = DEFAULTS.predict.coarser
_LOOK_S = DEFAULTS.predict.look_s


class Simulations:
    """Chosen stretches and their simulations.

    A body is looked at in a stretch's first and last frame, and in between so often that chords do for other times.
    """

    def __init__(
        self, tracks: StretchTracks, fine: Simulator, coarse: Simulator, rests: tuple[Rest, Rest], exactly: Array
    ) -> None:
        self.tracks, self._fine, self._coarse, self._rests = tracks, fine, coarse, rests
        self.exactly = exactly
        """What is seen of the model without effects, simulated finely: (looks, 3, sites, 2)."""
        self._first = np.concatenate([[0], np.cumsum(fine.counts)])
        step_s = float(fine.machine.model.opt.timestep)
        self._look_s = np.concatenate([(d.frames - d.frames[0]) * step_s for d in fine.drives])

    @classmethod
    def of(cls, tracks: StretchTracks, mechanism: Mechanism) -> Simulations:
        """All stretches of these tracks."""
        fine_s = float(machine(mechanism).model.opt.timestep)
        looks = _looks(tracks, fine_s)
        sims = [
            Simulator(machine(mechanism, dt_s), _drives(tracks, dt_s, looks), cores())
            for dt_s in (fine_s, _COARSER * fine_s)
        ]
        rests = sims[0].at_rest(), sims[1].at_rest()
        exactly = _stacked(sims[0].sightings(sims[0].machine.plant, rests[0]))
        return cls(tracks, sims[0], sims[1], rests, exactly)

    def __len__(self) -> int:
        return len(self.tracks.told)

    def looks_of(self, chosen: NDArray[np.int64]) -> NDArray[np.int64]:
        """The looks of some stretches."""
        return np.concatenate([np.arange(self._first[i], self._first[i + 1]) for i in chosen])

    def only(self, chosen: NDArray[np.int64]) -> Simulations:
        """Some of the stretches."""
        fine, coarse = (
            Simulator(whole.machine, [whole.drives[i] for i in chosen], cores()) for whole in (self._fine, self._coarse)
        )
        rests = self._rests[0].only(chosen), self._rests[1].only(chosen)
        return Simulations(self.tracks.of(chosen), fine, coarse, rests, self.exactly[self.looks_of(chosen)])

    def seen(self, model: Model) -> Array:
        """What is seen of a model, simulated coarsely; (looks, 3, sites, 2)."""
        assert isinstance(model, JointedModel)
        return self.seen_of(model.plant)

    def seen_of(self, plant: Plant) -> Array:
        """The same of a plant."""
        rest = self._rests[1]
        if (np.minimum(plant.stiffness, plant.torque) < 1).any():  # a servo that gives no torque did not bring its joint anywhere
            rest = replace_state(rest, self._coarse.settled(plant))
        return _stacked(self._coarse.sightings(plant, rest))

    @property
    def plant(self) -> Plant:
        """The plant with nothing wrong."""
        return self._coarse.machine.plant

    def at(self, points_m: Array, since_s: Array) -> Array:
        """Points (frames, sites, 2) that were looked at (looks, sites, 2), at times since_s (frames,) of their stretches."""
        stretch = self.tracks.stretch
        first, last = self._first[stretch], self._first[stretch + 1] - 1
        since = np.clip(since_s, 0.0, self._look_s[last])
        # times of all stretches one after the other, so that one search finds all
        offset = np.concatenate([[0.0], np.cumsum(self._look_s[self._first[1:] - 1] + 1.0)])
        of_look = np.repeat(np.arange(len(self)), self._fine.counts)
        at = np.searchsorted(self._look_s + offset[of_look], since + offset[stretch], side="right")
        upper = np.clip(at, first + 1, last)
        lower = upper - 1
        share = (since - self._look_s[lower]) / np.maximum(self._look_s[upper] - self._look_s[lower], 1e-12)
        out: Array = points_m[lower] + share[:, None, None] * (points_m[upper] - points_m[lower])
        return out


def _looks(tracks: StretchTracks, dt_s: float) -> NDArray[np.int64]:
    """How often each stretch is looked at: at its ends; more often where it was seen in between."""
    between = np.bincount(tracks.stretch) > 2
    out = np.full(len(tracks.told), 2)
    for i in np.flatnonzero(between):
        ends = tracks.told[i].drive(dt_s, tracks.pose[tracks.begins[i]], 2).frames
        out[i] = max(int(np.ceil((ends[-1] - ends[0]) * dt_s / _LOOK_S)), 1) + 1
    return out


def _drives(tracks: StretchTracks, dt_s: float, looks: NDArray[np.int64]) -> list[Drive]:
    begins = tracks.pose[tracks.begins]
    return [told.drive(dt_s, begin, int(n)) for told, begin, n in zip(tracks.told, begins, looks, strict=True)]


def _stacked(s: Sighting) -> Array:
    return np.stack([s.point_m, s.along, s.left], axis=1)
