"""A robot on joints as physics sees it: a MuJoCo body and the effects switched on."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from bns.errors import ModelError, unknown_name
from bns.physics.applied import applied
from bns.physics.effect import REFERENCE_WHEELBASE_M, Effect
from bns.physics.jointed.catalogue import catalogue
from bns.physics.jointed.mechanism import Mechanism, machine
from bns.physics.jointed.plant import Plant, Sighting
from bns.physics.model import Model

BASE = "mujoco"


@dataclass(frozen=True)
class JointedModel(Model):
    """A `Model` that is a body on joints.

    ``written``: how a model file names the body. It has no wheels: ``wheelbase_m`` only stands where ranges of effects ask for a
    size, which those of a body do not. ``dt_s`` is the body's own.
    """

    wheelbase_m: float = REFERENCE_WHEELBASE_M
    base: str = BASE
    mechanism: Mechanism = field(kw_only=True)
    written: Mapping[str, Any] = field(default_factory=dict, kw_only=True)

    bases: ClassVar[tuple[str, ...]] = (BASE,)

    def catalogue(self) -> Mapping[str, Effect]:
        """Name -> effect of a body with these joints and tracked sites."""
        body = machine(self.mechanism)
        return catalogue(body.limited, body.sites, body.links, body.on_the_floor, body.free)

    def effect_named(self, name: str) -> Effect:
        """The effect of that name of its catalogue; ModelError with the names there are."""
        known = self.catalogue()
        if name not in known:
            raise ModelError(unknown_name("effect of a body on joints", name, list(known)))
        return known[name]

    @property
    def free(self) -> bool:
        """Does it lie free on a floor?"""
        return machine(self.mechanism).free

    @property
    def plant(self) -> Plant:
        """Servos, links and floor with the effects switched on."""
        plant = machine(self.mechanism).plant
        for active in self.at("mechanics"):
            plant = applied(active.effect, plant, active.by_name)
        return plant

    def seen(self, sighting: Sighting) -> Sighting:
        """What the camera makes of it."""
        for active in self.at("sight"):
            sighting = applied(active.effect, sighting, active.by_name)
        return sighting

    def canonical_json(self) -> str:
        """As of every model, and the body."""
        return json.dumps({"model": super().canonical_json(), "mechanism": self.mechanism.sha256})

    def written_base(self) -> dict[str, Any]:
        """How the model file names the body."""
        return {"base": self.base, **self.written}

    @property
    def limited_by_set_points(self) -> bool:
        """Has it a limit of its servos' speed that is a share of how fast the set points at hand move?

        Not where the speed is known, nor of a robot whose servos are all told to move at the same one.
        """
        known = self.mechanism.fastest_set_point_rad_s or self.mechanism.joint_speed_rad_s
        return not known and bool(np.isfinite(self.plant.speed).any())

    def by_set_points(self, fastest_rad_s: float) -> JointedModel:
        """The model with its servos' limit as a share of this speed, so that it is the same for other set points."""
        mechanism = replace(self.mechanism, fastest_set_point_rad_s=fastest_rad_s)
        return replace(self, mechanism=mechanism, written={**self.written, "fastest_set_point_rad_s": fastest_rad_s})
