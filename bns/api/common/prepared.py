"""Data and model brought together: is the model one of this robot, and can these poses be worked with?"""

from __future__ import annotations

from dataclasses import dataclass, replace
from os import fspath
from pathlib import Path

from bns.api.measurements import Log, Measurements, as_measurements
from bns.api.model import Given, Model, as_model
from bns.diagnose.data.cycles import CycleTracks
from bns.diagnose.data.load import Measured
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.check_robot import check_named_robot, check_same_robot
from bns.diagnose.predict.saved_networks import network_predictor, networks_file
from bns.diagnose.predict.wheels import WheelPredictor, predictor_for_search
from bns.errors import DataError, ModelError
from bns.physics import model as physics
from bns.physics.model import model_names


@dataclass(frozen=True)
class Prepared:
    """A model on wheels over the poses that are used. ``measured`` has the same poses."""

    log: Measurements
    measured: Measured
    predictor: WheelPredictor
    model: Model

    @property
    def thinned(self) -> str:
        """How many of the poses are used, in words; "" for all."""
        used, there = len(self.predictor.tracks.t_s), len(self.log.measured.tracks.t_s)
        return f"{used} of {there} poses are used, evenly chosen; all commands are" if used < there else ""


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
    if _networks(model) is not None:
        raise ModelError(f"{_name(model)} holds networks, which have no effects: they can be compared, not diagnosed.")
    robot = as_model(model)
    read = as_measurements(log)
    measured = read.measured
    check_named_robot(measured.robot, robot)
    if isinstance(measured.tracks, CycleTracks):
        raise DataError(
            f"{measured.path} holds cycles and markers, and the model {robot.name} drives wheels; "
            "compare them with networks: --model snake, or a file (.safetensors) of bns run --robot snake --save-snn FILE."
        )
    predictor = predictor_for_search(measured.tracks)
    if len(predictor.tracks.t_s) < len(measured.tracks.t_s):
        measured = replace(measured, tracks=predictor.tracks)
    check_same_robot(predictor, robot)
    return Prepared(read, measured, predictor, robot)


def prepared_networks(log: Log, model: Given) -> PreparedNetworks | None:
    """Networks over measurements; None if ``model`` is one on wheels."""
    found = _networks(model)
    if found is None:
        return None
    read = as_measurements(log)
    predictor = network_predictor(found[0], read.measured.tracks, found[1])
    return PreparedNetworks(read, predictor, Model(wheelbase_m=1.0, name=_name(model)))


def are_networks(model: Given) -> bool:
    """Does this name networks, which are compared, rather than a model on wheels?"""
    return _networks(model) is not None


def _networks(model: Given) -> tuple[Path, str] | None:
    return None if isinstance(model, physics.Model) else networks_file(fspath(model), model_names())


def _name(model: Given) -> str:
    return model.name if isinstance(model, physics.Model) else fspath(model)
