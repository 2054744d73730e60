"""How long before each stretch a robot on joints is simulated: until it does not show where its joints began."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bns.diagnose.data.bodies.joints import JointTracks
from bns.diagnose.data.bodies.stretches import SetPoints, StretchTracks, apart, stretches_of_joints
from bns.diagnose.data.tracks import Array
from bns.diagnose.settings import DEFAULTS
from bns.extras import deferred
from bns.physics.jointed.drives import RUN_UP_S
from bns.physics.jointed.mechanism import Machine, Mechanism, machine
from bns.physics.jointed.simulate import Simulator
from bns.sweep.jobs.cores import cores

mujoco = deferred("snake", "mujoco")

_COARSER = DEFAULTS.predict.coarser
_LONGEST_S = DEFAULTS.predict.run_up_longest_s
_SHOWS_M = DEFAULTS.predict.run_up_shows_m
_ASKED = DEFAULTS.predict.run_up_stretches
_NEAR = DEFAULTS.predict.began_near


def joint_stretches(tracks: JointTracks, mechanism: Mechanism, of: StretchTracks | None = None) -> StretchTracks:
    """Trials cut into stretches, with a run-up as long as the body needs.

    The joints of a body that is quick and stiff are where they are told to be after two seconds, wherever they began; those of a
    slow or a soft one are not. The run-up is doubled as long as that halves what shows of its begin. Of a trial that begins in
    motion, stretches without a whole run-up are left out, unless there are no others. ``of``: those that another body was judged
    on, and no others, whatever run-up this one needs.
    """
    body = machine(mechanism)
    began = _began(tracks, body)
    out = stretches_of_joints(tracks, mechanism, body.joints, began=[one.posture for one in began])
    run_up_s, before_m = RUN_UP_S, np.inf
    while run_up_s < _LONGEST_S:
        shows_m = _shows_m(out, mechanism, run_up_s)
        if shows_m > before_m / 2:
            run_up_s /= 2
            break
        if shows_m <= _SHOWS_M:
            break
        run_up_s, before_m = 2 * run_up_s, shows_m
    if of is not None:
        wanted = set(_begun(of))
        return _with_run_up(out.of(np.flatnonzero([begun in wanted for begun in _begun(out)])), run_up_s)
    rested = {name for name, one in zip(tracks.names, began, strict=True) if one.at_rest}
    names = np.array(out.names)[out.trial[out.begins]]
    whole = np.array([t.from_s - t.t_s[0] >= run_up_s - 1e-9 for t in out.told if isinstance(t, SetPoints)])
    sure = np.flatnonzero(whole | np.isin(names, list(rested)))
    return _with_run_up(out.of(sure) if len(sure) else out, run_up_s)


def _begun(stretches: StretchTracks) -> list[tuple[str, float]]:
    """The trial of each stretch, and when in it the stretch begins, s."""
    trials = [stretches.names[trial] for trial in stretches.trial[stretches.begins]]
    return [(name, told.from_s) for name, told in zip(trials, stretches.told, strict=True) if isinstance(told, SetPoints)]


def _with_run_up(stretches: StretchTracks, run_up_s: float) -> StretchTracks:
    return replace(stretches, told=tuple(replace(t, run_up_s=run_up_s) for t in stretches.told if isinstance(t, SetPoints)))


def _shows_m(stretches: StretchTracks, mechanism: Mechanism, run_up_s: float) -> float:
    """How far apart a run-up and one of twice its length end, root mean square over some stretches; 0 if none has one."""
    asked = [i for i, t in enumerate(stretches.told) if isinstance(t, SetPoints) and t.from_s - t.t_s[0] > run_up_s]
    if not asked:
        return 0.0
    chosen = np.unique(np.linspace(0, len(asked) - 1, min(len(asked), _ASKED)).round().astype(np.int64))
    some = stretches.of(np.array(asked)[chosen])
    short, long = (_begins(_with_run_up(some, s), mechanism) for s in (run_up_s, 2 * run_up_s))
    return float(np.sqrt((np.abs(long - short).max(axis=(1, 2)) ** 2).mean()))


def _begins(stretches: StretchTracks, mechanism: Mechanism) -> Array:
    """Where the sites (stretches, sites, 2) are simulated to be when each stretch begins."""
    body = machine(mechanism, _COARSER * float(machine(mechanism).model.opt.timestep))
    dt_s = float(body.model.opt.timestep)
    drives = [told.drive(dt_s, begin, 2) for told, begin in zip(stretches.told, stretches.pose[stretches.begins], strict=True)]
    simulator = Simulator(body, [replace(d, frames=d.frames[:1]) for d in drives], cores())
    return simulator.sightings(body.plant, simulator.at_rest()).point_m


@dataclass(frozen=True)
class _Began:
    """How a trial began: at rest? In which ``posture`` (joints,); None: in that of its first set points."""

    posture: Array | None
    at_rest: bool


def _began(tracks: JointTracks, body: Machine) -> list[_Began]:
    """How each trial began: at rest in the model's own posture or in its first set points if its first pose is near to either."""
    columns = [tracks.joints.index(name) for name in body.joints]
    order = [tracks.sites.index(name) for name in body.mechanism.sites]
    home, shapes = body.model.qpos0[body.joint_at], _shapes(tracks.points_m[:, order], body.free)
    usual_m = float(np.sqrt(((shapes - shapes.mean(axis=0)) ** 2).mean()))
    out = []
    for first, (_, told) in zip(tracks.first[:-1], tracks.rows, strict=True):
        off_m = []
        for posture in (home, told[0, columns]):
            expected = _shapes(_sites_m(body, posture)[None], body.free)[0]
            off_m.append(float(np.sqrt(((expected - shapes[first]) ** 2).mean())))
        out.append(_Began(home if off_m[0] < off_m[1] else None, min(off_m) <= _NEAR * usual_m))
    return out


def _shapes(points_m: Array, free: bool) -> Array:
    """What postures decide of tracked points (frames, sites, 2): where they are; of a free body, how far from one another."""
    return apart(points_m) if free else points_m.reshape(len(points_m), -1)


def _sites_m(body: Machine, posture: Array) -> Array:
    """Where the tracked sites (sites, 2) are when the joints are in a posture (joints,) and nothing else has moved."""
    data = mujoco.MjData(body.model)
    data.qpos[body.joint_at] = posture
    mujoco.mj_kinematics(body.model, data)
    return np.array([data.site(name).xpos[:2] for name in body.mechanism.sites])
