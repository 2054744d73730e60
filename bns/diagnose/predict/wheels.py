"""What a differential drive with effects predicts from frame to frame."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array, Tracks, slimmed
from bns.diagnose.predict.base import Steps
from bns.diagnose.predict.horizons import HORIZONS, windows
from bns.diagnose.predict.luck import Luck
from bns.diagnose.predict.pictures import pictured, undone
from bns.diagnose.settings import DEFAULTS
from bns.engine.pose_filter import displacements, followed
from bns.physics.applied import applied, starts_of
from bns.physics.effect import Effect
from bns.physics.model import ActiveEffect, Model
from bns.physics.signals import Body, Conditions, Logged, View, Wheels
from bns.physics.wheels.differential_drive import stamps_of
from bns.physics.wheels.grid import Grid
from bns.physics.wheels.motion import flow_of, wheel_motion, with_body_effects
from bns.physics.wheels.scans import low_passed

RECENT_S = DEFAULTS.predict.recent_s
_COARSE_S = DEFAULTS.predict.coarse_s
_RUN_UP_STEP_S = DEFAULTS.data.run_up_step_s
_TAIL_S = DEFAULTS.predict.tail_s
_KEPT = 500_000
"""Steps of the grid (or frames) whose motion is remembered, over all models that were asked lately: some 50 MB."""
_UNDONE = DEFAULTS.predict.picture_rounds
_MOVING = ("wheel", "body")
_DELAY = "command-delay"
_STATEFUL = (
    *("motor-lag", "inertia-lag", "lag-mismatch", "braking-lag", "gear-friction", "scrub-friction"),
    *("controller-overshoot", "backlash"),
)
"""Effects behind a delay of commands to which it makes no difference whether the delay is before or behind them."""

Chain = tuple[tuple[Effect, tuple[float, ...], tuple[float, ...]], ...]
"""Effects that act, their values, and those of each trial."""

_OF_PLACE = frozenset({"x_m", "y_m", "heading_rad", "turned_rad"})


class WheelPredictor:
    """Drives the commands of tracks once, and answers any model with the displacement between successive frames."""

    horizons: tuple[str, ...] = HORIZONS
    near = "1s"
    tracking: tuple[float, float] | None = None
    counted: Array | None = None
    luck: Luck | None = None
    screening = None

    def __init__(self, tracks: Tracks, dt_s: float = 0.04, delays_s: Collection[float] = ()) -> None:
        """``dt_s`` (s): longest step of the grid. ``delays_s`` (s): of commands or of poses' stamps, for which it is exact."""
        self.tracks, self._dt_s, self._delays_s = tracks, dt_s, tuple(delays_s)
        self.grid = _grid_of(tracks, dt_s, self._delays_s)
        self._place = np.stack([self._seen_on_grid(name) for name in ("x_m", "y_m", "heading_rad")], axis=2)
        seen = np.where(_between_frames(tracks, self.grid)[..., None], self._place, np.nan)
        self.conditions = replace(_conditions(tracks, self.grid.node_s), seen=seen)
        zero = np.zeros_like(self.grid.step_s)
        wheels_m_s = (np.abs(self.grid.left_m_s) + np.abs(self.grid.right_m_s)) / 2
        way = followed(self.grid.step_s, wheels_m_s, zero, zero, zero, tracks.trial, tracks.t_s)[0][:, 0]
        self.way_m = self._since_previous(way)
        self._no_drift = np.zeros((len(tracks.t_s), 2))
        self._of_horizon = lru_cache(partial(windows, tracks))
        self._starts: dict[tuple[str, float, Chain], tuple[tuple[float, ...], ...]] = {}
        # a slope of what a camera does asks for the same drive again, and one of a clock for the same motion
        kept = 1 + _KEPT // max(zero.size, len(tracks.t_s))
        self._wheels = lru_cache(kept)(self._turned)
        self._where = lru_cache(kept)(self._found)
        self._body, self._at = lru_cache(kept)(self._driven), lru_cache(kept)(self._followed)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.tracks, self._dt_s, self._delays_s)  # what it remembers is worked out again

    def driving(self, tracks: Tracks) -> WheelPredictor:
        """The predictor of other tracks, or of the same ones with other commands, on a grid that is as fine."""
        return WheelPredictor(tracks, self._dt_s, self._delays_s)

    def exact_for(self, delays_s: Collection[float]) -> WheelPredictor:
        """The same tracks, on a grid on which these delays (s) of commands and of stamps are exact."""
        out = WheelPredictor(self.tracks, self._dt_s, delays_s)
        out.counted = self.counted
        return out

    def not_counting(self, trials: Collection[int]) -> WheelPredictor:
        """The same tracks, of which these trials count nothing in a fit; what is predicted of them is judged all the same."""
        out = copy(self)
        out.counted = (~np.isin(self.tracks.trial, list(trials))).astype(np.float64)
        return out

    def steps(self, model: Model) -> Steps:
        """Displacement of the tracked point since the frame before, in the frame of the robot there."""
        return self._seen_as(model, lambda poses: poses)

    def smoothed_steps(self, model: Model, tau_s: float) -> Steps:
        """The same as a tracker sees them that smooths its poses: a first-order low-pass filter with this time constant."""
        return self._seen_as(model, lambda poses: low_passed(poses, self.tracks.t_s, self.tracks.is_first, tau_s))

    def _seen_as(self, model: Model, tracker: Callable[[Array], Array]) -> Steps:
        poses, sums = self._at(model.wheelbase_m, _chain(model, (*_MOVING, "clock")))
        view, placed = View(tracker(poses)), [active for active in model.at("measure") if active.effect.needs_place]
        for active in model.at("measure"):
            if not active.effect.needs_place:
                view = applied(active.effect, view, active.by_name)
        body = displacements(view.poses, self.tracks.is_first)
        return Steps(self._pictured(body, placed) if placed else body, self._drift(model, poses, sums))

    def anchor(self, model: Model, alone: bool = False) -> bool:
        """Every answer is exact."""
        return False

    def _pictured(self, body: Array, placed: Sequence[ActiveEffect]) -> Array:
        """Displacements (frames, 3) as they look where the robot was seen: the picture is undone there, and made again."""
        really, from_ = self._where(tuple((a.effect, a.values, a.trial_values) for a in placed))
        cos, sin = np.cos(really[:, 2]), np.sin(really[:, 2])
        moved = [cos * body[:, 0] - sin * body[:, 1], sin * body[:, 0] + cos * body[:, 1], body[:, 2]]
        to = pictured(placed, really + np.stack(moved, axis=1))
        way, cos, sin = to - from_, np.cos(from_[:, 2]), np.sin(from_[:, 2])
        ahead, left = cos * way[:, 0] + sin * way[:, 1], cos * way[:, 1] - sin * way[:, 0]
        return np.where(self.tracks.is_first[:, None], 0.0, np.stack([ahead, left, way[:, 2]], axis=1))

    def _found(self, chain: Chain) -> tuple[Array, Array]:
        """Where the robot was at the frame before each, by the effects of a picture, and what they show of it; read-only."""
        placed = _model_of(1.0, chain).effects
        really = undone(partial(pictured, placed), np.roll(self.tracks.pose, 1, axis=0))
        shown = pictured(placed, really)
        really.flags.writeable = shown.flags.writeable = False
        return really, shown

    def _turned(self, wheelbase_m: float, chain: Chain) -> Body:
        return replace(wheel_motion(_model_of(wheelbase_m, chain), self.grid, self.conditions), place=self._place)

    def _driven(self, wheelbase_m: float, chain: Chain) -> Body:
        model = _model_of(wheelbase_m, chain)
        return with_body_effects(model, self._wheels(wheelbase_m, _chain(model, ("wheel",))))

    def _followed(self, wheelbase_m: float, chain: Chain) -> tuple[Array, Array]:
        """`followed` at the frames; read-only, for many models share it."""
        model, grid, tracks = _model_of(wheelbase_m, chain), self.grid, self.tracks
        body = self._body(wheelbase_m, _chain(model, _MOVING))
        velocities = body.forward_m_s, body.sideways_m_s, body.yaw_rad_s, body.moving
        stamps = stamps_of(model, tracks.t_s, tracks.trial)
        poses, sums = followed(grid.step_s, *velocities, tracks.trial, stamps.t_s)
        if stamps.heading_late_s:
            before_s = stamps.t_s - stamps.heading_late_s
            poses[:, 2] = followed(grid.step_s, *velocities, tracks.trial, before_s)[0][:, 2]
        poses.flags.writeable = sums.flags.writeable = False
        return poses, sums

    def turned(self, model: Model) -> Body:
        """The wheels, at every step of the grid, as the model's effects of the wheels turn them."""
        return self._wheels(model.wheelbase_m, _chain(model, ("wheel",)))

    def starts_of(self, effect: Effect, model: Model) -> tuple[tuple[float, ...], ...]:
        """What the effect's ``starts_from`` makes of these poses, and of the wheels as the model turns them; kept.

        One that acts on the wheels gets them as those before it turn them. Its neutral values if nothing.
        """
        chain = _chain(model, ("wheel",))
        if effect.stage == "wheel":
            chain = tuple(one for one in chain if model.key_of(one[0]) < model.key_of(effect))
        known = effect.name, model.wheelbase_m, chain
        if known not in self._starts and effect.starts_from is not None:
            turned = self._wheels(model.wheelbase_m, chain)
            given = Wheels(self.grid.step_s, turned.left_m_s, turned.right_m_s, model.wheelbase_m, self.conditions)
            self._starts[known] = starts_of(effect, given) or (tuple(effect.neutral.values()),)
        return self._starts[known]

    def windows(self, horizon: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Back to back within each trial."""
        return self._of_horizon(horizon)

    def scores(self) -> Mapping[str, Mapping[str, float]]:
        """A model of wheels has but a path."""
        return {}

    def variables(self) -> dict[str, Array]:
        """What the robot was told and where it was, at every step of the grid, (trials, steps)."""
        grid, tracks = self.grid, self.tracks
        middle = (grid.node_s[:, 1:] + grid.node_s[:, :-1]) / 2
        changed = (np.diff(grid.left_m_s, axis=1, prepend=0) != 0) | (np.diff(grid.right_m_s, axis=1, prepend=0) != 0)
        began = np.maximum.accumulate(np.where(changed, grid.node_s[:, :-1], 0.0), axis=1)
        speed, turn = (grid.left_m_s + grid.right_m_s) / 2, grid.right_m_s - grid.left_m_s
        way = np.cumsum((np.abs(grid.left_m_s) + np.abs(grid.right_m_s)) / 2 * grid.step_s, axis=1)
        if tracks.relative:  # measured motions, each by itself: nothing began, and they have no place
            return {
                "left_m_s": grid.left_m_s,
                "right_m_s": grid.right_m_s,
                "speed_m_s": speed,
                "wheel_difference_m_s": turn,
                "session_s": tracks.start_s[:, None] + middle,
                **{name: self._seen_on_grid(name) for name in self._seen() if name not in _OF_PLACE},
            }
        return {
            "left_m_s": grid.left_m_s,
            "right_m_s": grid.right_m_s,
            "speed_m_s": speed,
            "wheel_difference_m_s": turn,
            "previous_speed_m_s": _before(speed, changed),
            "previous_wheel_difference_m_s": _before(turn, changed),
            "time_in_command_s": middle - began,
            "time_in_trial_s": middle if tracks.lead_s is None else middle - tracks.lead_s[:, None],
            "session_s": tracks.start_s[:, None] + middle,
            "way_m": way,
            "left_change_m_s": _fresh_change(grid.left_m_s, middle - began, changed),
            "right_change_m_s": _fresh_change(grid.right_m_s, middle - began, changed),
            "left_reversed": _reversed(grid.left_m_s, grid.step_s),
            "right_reversed": _reversed(grid.right_m_s, grid.step_s),
            "just_started": np.exp(-middle / RECENT_S),
            **{name: self._seen_on_grid(name) for name in self._seen()},
        }

    def at_frames(self, frames: NDArray[np.int64]) -> dict[str, Array]:
        """`variables` at the times of some frames, (frames,) each."""
        rows = self.tracks.trial[frames]
        steps = np.array(
            [
                np.searchsorted(self.grid.node_s[r], t + 1e-9, side="right") - 1
                for r, t in zip(rows, self.tracks.t_s[frames], strict=True)
            ],
            dtype=np.int64,
        ).clip(0, self.grid.step_s.shape[1] - 1)
        return {name: values[rows, steps] for name, values in self.variables().items()}

    def _seen_on_grid(self, name: str) -> Array:
        middle, values = (self.grid.node_s[:, 1:] + self.grid.node_s[:, :-1]) / 2, self._seen()[name]
        return np.stack([_held(self.tracks, values, row, middle[row]) for row in range(len(self.tracks))])

    def _seen(self) -> dict[str, Array]:
        tracks = self.tracks
        headings = [np.unwrap(tracks.pose[a:b, 2]) for a, b in zip(tracks.first[:-1], tracks.first[1:], strict=True)]
        heading, turned = np.concatenate(headings), np.concatenate([one - one[:1] for one in headings])
        extra = {k: v for k, v in tracks.extra.items() if np.isfinite(v).sum() > 1 and k != "session_s"}
        return {"x_m": tracks.pose[:, 0], "y_m": tracks.pose[:, 1], "heading_rad": heading, "turned_rad": turned, **extra}

    def _since_previous(self, values: Array) -> Array:
        change = np.diff(values, axis=0, prepend=values[:1])
        change[self.tracks.is_first] = 0.0
        return change

    def _drift(self, model: Model, path: Array, sums: Array) -> Array:
        """What the floor adds in the world's frame between where the robot was seen (millimetres do not matter there).

        A robot gets far between poses at the ends of commands: it is taken to be midway, and off that line as its path is.
        """
        flow = flow_of(model)
        if (flow.x_m_s, flow.y_m_s, flow.return_per_s) == (0.0, 0.0, 0.0):
            return self._no_drift
        time_s, *where = self._since_previous(sums).T
        way, before, seen = self._since_previous(path), np.roll(path, 1, axis=0), self.tracks.pose
        bent = np.stack(where, axis=1) - time_s[:, None] * (before + way / 2)[:, :2]
        turned = np.roll(seen[:, 2], 1) - before[:, 2]
        cos, sin = np.cos(turned), np.sin(turned)
        bent = np.stack([cos * bent[:, 0] - sin * bent[:, 1], sin * bent[:, 0] + cos * bent[:, 1]], axis=1)
        midway = (seen + np.roll(seen, 1, axis=0))[:, :2] / 2
        out: Array = np.array([flow.x_m_s, flow.y_m_s]) * time_s[:, None] - flow.return_per_s * (
            midway * time_s[:, None] + bent
        )
        return out


def _chain(model: Model, stages: Sequence[str]) -> Chain:
    """The effects of some stages; a delay of commands behind lags and play.

    Late is late, before or behind them. But they take a speed as constant in a step, which a late command is not where it
    begins within one: behind them the error is that of a late clock, which does the same.
    """
    effects = [a for a in model.effects if a.effect.stage in stages]
    places = [i for i, a in enumerate(effects) if a.effect.name in _STATEFUL]
    for i in [i for i, a in enumerate(effects) if a.effect.name == _DELAY and places and i < places[-1]]:
        effects.insert(places[-1], effects.pop(i))
    return tuple((a.effect, a.values, a.trial_values) for a in effects)


def _model_of(wheelbase_m: float, chain: Chain) -> Model:
    """Of effects that were checked in the model that they come from."""
    effects = tuple(
        ActiveEffect(e, values, per_trial=bool(trial_values), trial_values=trial_values) for e, values, trial_values in chain
    )
    return Model(wheelbase_m).derived(effects=effects)


def predictor_for_search(tracks: Tracks) -> WheelPredictor:
    """A predictor that answers fast enough to be asked thousands of times: of many poses some, and then in coarser steps."""
    slim = slimmed(tracks)
    return WheelPredictor(slim) if slim is tracks else WheelPredictor(slim, dt_s=_COARSE_S)


def _grid_of(tracks: Tracks, dt_s: float, delays_s: Sequence[float] = ()) -> Grid:
    """Steps of at most ``dt_s`` that end wherever a command or a frame does: a pose inside a step would lie on a chord.

    ``delays_s``: they also end so long after each command and so long before each frame: neither a late change of speed nor
    the pose behind a late stamp then lies inside a step.
    """
    nodes, lefts, rights = [], [], []
    for trial in range(len(tracks)):
        frames = tracks.t_s[tracks.first[trial] : tracks.first[trial + 1]]
        lead = 0.0 if tracks.lead_s is None else tracks.lead_s[trial]
        ends = np.cumsum(tracks.duration_s[trial])
        last = max(ends[-1], *frames[-1:]) + _TAIL_S
        late = [part for d in delays_s for part in (np.append(0.0, ends) + d, frames - d)]
        marks = np.concatenate([[0.0, lead, last], ends, frames, *late]).round(9)
        marks = np.unique(marks[(marks >= 0) & (marks <= last)])
        longest = np.where(marks[1:] <= lead + 1e-9, max(dt_s, _RUN_UP_STEP_S), dt_s)
        counts = np.maximum(np.ceil(np.diff(marks) / longest - 1e-9).astype(np.int64), 1)
        inner = np.concatenate([[0.0], np.repeat(np.diff(marks) / counts, counts)])
        node = marks[0] + np.cumsum(inner)
        lasting = np.flatnonzero(tracks.duration_s[trial] > 0)
        middle = (node[1:] + node[:-1]) / 2
        which = np.append(lasting, len(ends) - 1)[np.searchsorted(ends[lasting], middle)]
        nodes.append(node)
        lefts.append(tracks.left_m_s[trial][which])
        rights.append(tracks.right_m_s[trial][which])
    width = max(map(len, nodes))
    node_s = np.stack([np.pad(node, (0, width - len(node)), mode="edge") for node in nodes])
    left, right = (np.stack([np.pad(v, (0, width - 1 - len(v))) for v in values]) for values in (lefts, rights))
    return Grid(np.diff(node_s, axis=1), node_s, left, right, np.zeros((len(nodes), 0), dtype=np.int64))


def _before(values: Array, changed: NDArray[np.bool_]) -> Array:
    """What was in force before the last change, at every step; 0 before the first."""
    before = np.pad(values, ((0, 0), (1, 0)))[:, :-1]
    out = np.zeros_like(values)
    current = np.zeros(len(values))
    for k in range(values.shape[1]):
        current = np.where(changed[:, k], before[:, k], current)
        out[:, k] = current
    return out


def _fresh_change(speed: Array, since_s: Array, changed: NDArray[np.bool_]) -> Array:
    """By how much a command changed, fading once it is in force."""
    change: Array = (speed - _before(speed, changed)) * np.exp(-since_s / RECENT_S)
    return change


def _reversed(speed: Array, step_s: Array) -> Array:
    """The direction of a wheel since it last turned round, fading from 1 or -1; 0 where it never did."""
    out, fresh, sign = np.zeros_like(speed), np.zeros(len(speed)), np.zeros(len(speed))
    for k in range(speed.shape[1]):
        now = np.sign(speed[:, k])
        fresh = np.where((now != 0) & (sign != 0) & (now != sign), 1.0, fresh)
        sign = np.where(now != 0, now, sign)
        half = np.exp(-step_s[:, k] / (2 * RECENT_S))
        out[:, k], fresh = sign * fresh * half, fresh * half * half
    return out


def _conditions(tracks: Tracks, node_s: Array) -> Conditions:
    middle = (node_s[:, 1:] + node_s[:, :-1]) / 2
    volts = tracks.extra.get("battery_v")
    drop = None
    if volts is not None and np.isfinite(volts).any():
        reference = volts[np.isfinite(volts)][0]
        drop = np.stack([_held(tracks, volts, row, middle[row]) for row in range(len(tracks))]) - reference
        drop = -drop
    def on_grid(name: str) -> Array:
        values = tracks.extra[name]
        return np.stack([_held(tracks, values, row, middle[row]) for row in range(len(tracks))])

    there = [name for name, values in tracks.extra.items() if np.isfinite(values).any()]
    return Conditions(tracks.start_s[:, None] + middle, drop, logged=Logged(there, on_grid))


def _between_frames(tracks: Tracks, grid: Grid) -> NDArray[np.bool_]:
    """Steps that lie between the first and the last frame of their trial, (trials, steps)."""
    lasting = np.diff(tracks.first) > 0
    first, last = np.full(len(tracks), np.inf), np.full(len(tracks), -np.inf)
    first[lasting], last[lasting] = tracks.t_s[tracks.first[:-1][lasting]], tracks.t_s[tracks.first[1:][lasting] - 1]
    node = grid.node_s
    return np.asarray((node[:, :-1] >= first[:, None] - 1e-9) & (node[:, 1:] <= last[:, None] + 1e-9))


def _held(tracks: Tracks, values: Array, trial: int, t_s: Array) -> Array:
    frames = slice(tracks.first[trial], tracks.first[trial + 1])
    known = np.isfinite(values[frames])
    if not known.any():
        return np.full(len(t_s), np.nanmean(values))
    return np.interp(t_s, tracks.t_s[frames][known], values[frames][known])
