"""Data and model brought together: is the model one of this robot, and can these poses be worked with?"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bns.api.common.arguments import named_model
from bns.api.common.shown import counted
from bns.api.measurements import Log, Measurements, as_measurements
from bns.api.model import Given, Model, as_model
from bns.diagnose.adding import known_to
from bns.diagnose.data.bodies.cycles import CycleTracks, marker_noise_m
from bns.diagnose.data.bodies.joints import JointTracks, check_names, check_scales
from bns.diagnose.data.bodies.stretches import stretches_of_cycles
from bns.diagnose.data.load import Measured, naming
from bns.diagnose.data.tracks import Tracks
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.check_robot import check_named_robot, check_same_robot
from bns.diagnose.predict.jointed import JointedPredictor
from bns.diagnose.predict.run_ups import joint_stretches
from bns.diagnose.predict.saved_networks import network_predictor, networks_file
from bns.diagnose.predict.wheels import predictor_for_search
from bns.errors import DataError, ModelError, in_both
from bns.measurements import SET
from bns.physics import model as physics
from bns.physics.jointed.mechanism import machine
from bns.physics.jointed.model import JointedModel
from bns.physics.jointed.model_files import SNAKE
from bns.physics.model import model_names

_SNAKE = in_both("--model snake", 'the model "snake"')
_DRIVE = in_both(
    "--model khepera, or --model differential-drive --wheelbase METRES", 'the model "khepera", or bns.Model(wheelbase_m=METRES)'
)


@dataclass(frozen=True)
class Prepared:
    """A model with effects over the poses that are used. ``measured`` has the same poses."""

    log: Measurements
    measured: Measured
    predictor: Predictor
    model: Model

    @property
    def fitted_here(self) -> str:
        """That the model was fitted to these very measurements, in words; "" where it was not."""
        known = known_to(self.model, self.measured)
        if not known:
            return ""
        return (
            f"The model as given was fitted to {these_very(known, self.measured)}: its errors are those of trials that it "
            "knows, not of trials held out, and lower than on new ones."
        )

    @property
    def thinned(self) -> str:
        """How many of the poses are used, in words; "" for all. Of a body also which set points are not."""
        if isinstance(self.predictor, JointedPredictor):
            tracks = self.log.measured.tracks
            return _used_in_words(tracks, self.predictor) + _of_no_servo(tracks, self.model)
        used, there = len(self.predictor.tracks.t_s), len(self.log.measured.tracks.t_s)
        return f"{used} of {there} poses are used, evenly chosen; all commands are" if used < there else ""


def these_very(known: str, measured: Measured) -> str:
    """The measurements of the logs ``known``, which a model was fitted to, in words."""
    part = "" if known == measured.called else "some of "
    return f"{part}these very measurements ({known})"


@dataclass(frozen=True)
class PreparedNetworks:
    """Networks over the poses; ``model`` only has their name."""

    log: Measurements
    predictor: Predictor
    model: Model


def prepared(log: Log, model: Given) -> Prepared:
    """A model over measurements. Of very many poses only some are taken, the same by every command.

    Raises:
        ModelError: no such model, or networks, which have no effects.
        DataError: measurements that cannot be used, or of another robot.
    """
    robot = with_effects(model)
    read = as_measurements(log)
    measured = read.measured
    check_displacements(measured)
    check_named_robot(measured.robot, robot)
    if isinstance(robot, JointedModel):
        return _prepared_body(read, robot)
    if isinstance(measured.tracks, CycleTracks):
        raise DataError(
            f"{measured.path} holds cycles and markers, and the model {robot.name} drives wheels; give the model of the robot "
            f"that was driven in cycles: {_SNAKE}."
        )
    if isinstance(measured.tracks, JointTracks):
        raise DataError(
            f"{measured.path} holds set points of joints, and the model {robot.name} drives wheels; give the model of the "
            "body, an MJCF file (.xml) or a model file that names one."
        )
    predictor = predictor_for_search(measured.tracks)
    if len(predictor.tracks.t_s) < len(measured.tracks.t_s):
        measured = replace(measured, tracks=predictor.tracks)
    check_same_robot(predictor, robot)
    return Prepared(read, measured, predictor, robot)


def check_displacements(measured: Measured) -> None:
    """DataError for measurements in which no trial has two tracked poses: they show no motion."""
    poses = np.diff(measured.tracks.first)
    if not (poses > 1).any():
        held = f"{counted(len(poses), 'trial')} with {counted(int(poses.sum()), 'tracked pose')}"
        raise DataError(
            f"{measured.called}: no trial has two tracked poses, and a displacement needs two; the log holds {held}. Log the "
            "pose before and after commands; rows of one drive have the same name in the column trial."
        )


def with_effects(model: Given) -> Model:
    """The model that is given; ModelError if these are networks."""
    if _networks(model) is not None:
        raise ModelError(f"{_name(model)} holds networks, which have no effects: they can be compared, not diagnosed.")
    return as_model(model)


def _prepared_body(read: Measurements, model: Model) -> Prepared:
    """A body on joints over cycles of it."""
    measured = read.measured
    assert isinstance(model, JointedModel)
    tracks = measured.tracks
    if not isinstance(tracks, CycleTracks | JointTracks):
        raise DataError(
            f"{measured.path} holds wheel speeds and poses, and the model {model.name} is a body on joints; give the model of a "
            f"drive: {_DRIVE}."
        )
    body = machine(model.mechanism)
    if isinstance(tracks, CycleTracks):
        if model.name != SNAKE and model.written.get("body") != SNAKE:
            raise DataError(f"{measured.path} holds cycles of the snake, and {model.name} is another body; give {_SNAKE}.")
        if not tracks.stable.any():
            raise DataError(f"{measured.path}: no cycle is stable, and only stable ones are compared with a simulated body.")
        stretches = stretches_of_cycles(tracks, model.mechanism, len(body.joints))
        predictor = JointedPredictor(stretches, model, "cycle", marker_noise_m(tracks))
    else:
        check_names(tracks, body.joints, model.mechanism.sites)
        with naming(measured.path):
            check_scales(tracks, body.joints, body.told, None if body.free else float(body.model.stat.extent))
        predictor = JointedPredictor(joint_stretches(tracks, model.mechanism), model, "stretch")
    return Prepared(read, replace(measured, tracks=predictor.tracks), predictor, model)


def _of_no_servo(tracks: Tracks, model: Model) -> str:
    """Which set points of the measurements the model has no servo for."""
    if not isinstance(tracks, JointTracks) or not isinstance(model, JointedModel):
        return ""
    servos = machine(model.mechanism).joints
    others = [name + SET for name in tracks.joints if name not in servos]
    return f"; {', '.join(others)}: the model has no such servo, so what it was told is not used" if others else ""


def _used_in_words(tracks: Tracks, predictor: JointedPredictor) -> str:
    """Which stretches are compared."""
    used, wild, aside = len(predictor.windows(predictor.near)[0]), predictor.left_out, predictor.not_taken
    unstable = int((~tracks.stable).sum()) if isinstance(tracks, CycleTracks) else 0
    what = "stretches" if predictor.near == "stretch" else f"{predictor.near}s"
    more = f"{unstable} were not stable, and " if unstable else ""
    return (
        f"{used} of {used + wild + unstable + aside} {what} are compared; {more}{wild} cannot be predicted: a small "
        f"disturbance moves the robot far in them{f'; {aside} are excluded, evenly spaced, for speed' if aside else ''}"
    )


def prepared_networks(log: Log, model: Given) -> PreparedNetworks | None:
    """Networks over measurements; None if ``model`` is one on wheels."""
    found = _networks(model)
    if found is None:
        return None
    read = as_measurements(log)
    check_displacements(read.measured)
    predictor = network_predictor(found[0], read.measured.tracks, found[1])
    return PreparedNetworks(read, predictor, Model(wheelbase_m=1.0, name=_name(model)))


def are_networks(model: Given) -> bool:
    """Does this name networks, which are compared, rather than a model on wheels?"""
    return _networks(model) is not None


def _networks(model: Given) -> tuple[Path, str] | None:
    return None if isinstance(model, physics.Model) else networks_file(named_model(model), [*model_names(), SNAKE])


def _name(model: Given) -> str:
    return model.name if isinstance(model, physics.Model) else named_model(model)
