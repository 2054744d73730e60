"""`bns.Model`: a robot's model by name, from a file, or from its numbers."""

from __future__ import annotations

import dataclasses
import hashlib
import html
import re
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from bns.api.common.arguments import as_path, named_model
from bns.errors import ModelError, in_both, unknown_name
from bns.physics import model as physics
from bns.physics.figures import with_unit
from bns.physics.jointed.mechanism import machine
from bns.physics.jointed.model import JointedModel
from bns.physics.jointed.model_files import is_body, load_body
from bns.physics.model import BASES, load_model
from bns.targets import obstacle

Given = str | PathLike[str] | physics.Model
_BODY = re.compile(r"^base:\s*[\"']?mujoco", re.MULTILINE)


class Model(physics.Model):
    """A robot with the effects that are switched on: a differential drive, or a body on joints.

    ``Model("snake")`` is the snake in MuJoCo, ``Model("robot.xml", sites=["head"])`` any MJCF file with position servos and
    tracked sites (`BodyModel`). ``Model("khepera")`` is a model that comes with bns, ``Model("mine.yaml")`` one from a file,
    ``Model(wheelbase_m=0.2)`` (or ``Model("differential-drive", wheelbase_m=0.2)``) a plain drive. Fields given by name replace
    those of the model: wheelbase_m (m), dt_s (s), jitter_relative (fraction of the commanded speed), noise_position_m (m),
    noise_heading_rad (rad).
    Models are immutable: `with_effect`, `without` and the like return a new one.

    Raises:
        ModelError: there is no such model, or a number is out of bounds; the message says what is allowed.
    """

    def __new__(cls, given: Given | None = None, /, **fields: Any) -> Model:
        """A body on joints where one is named, else a drive."""
        return object.__new__(BodyModel if cls is Model and _names_a_body(given) else cls)

    def __init__(self, given: Given | None = None, /, **fields: Any) -> None:
        known = [field.name for field in dataclasses.fields(physics.Model)]
        for name in fields:
            if name not in known:
                raise ModelError(unknown_name("field of a model", name, known))
        super().__init__(**{**_fields(given, fields), **fields})

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the model as a YAML file that `bns.Model` and every command read back; its path.

        ModelError unless the name ends in .yaml or .yml, and for an effect that is a Python object of no file.
        """
        from bns.store.disk.files import publish  # noqa: PLC0415  # a model that is not saved needs no store

        target = checked_target(as_path(path))
        for active in self.effects:
            if not active.written and active.effect.name not in self.catalogue():
                raise ModelError(
                    f"{active.effect.name} is an effect in Python, of which a model file can only name the file. Write it as "
                    "EFFECT in a file of its own, add that file (bns.add(log, 'my_effect.py', model)), and save what that gives."
                )
        effects = tuple(_named_from(active, target.resolve().parent) for active in self.effects)
        text = dataclasses.replace(self, effects=effects).to_yaml() if effects != self.effects else self.to_yaml()
        publish(text.encode(), target.with_name(f".{target.name}.part"), target)
        return target

    def to_yaml(self) -> str:
        """The text of the file that `save` writes."""
        from bns.diagnose.adding import model_yaml  # noqa: PLC0415  # loads the fits

        return model_yaml(self)

    @property
    def sha256(self) -> str:
        """Of the canonical JSON: all that changes numbers, neither name nor reasons; 64 digits."""
        return hashlib.sha256(self.canonical_json().encode()).hexdigest()

    def __eq__(self, other: object) -> bool:
        """Whether both simulate alike: names, reasons and provenance do not count."""
        return self.canonical_json() == other.canonical_json() if isinstance(other, physics.Model) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.canonical_json())

    def summary(self) -> str:
        """The numbers, one effect per line."""
        lines = [f"model {self.name}: {self.base}, wheelbase {self.wheelbase_m:g} m"]
        for active in self.effects:
            units = {p.name: p.unit for p in active.effect.parameters}
            numbers = ", ".join(f"{name} = {value:.5g}{with_unit(units[name])}" for name, value in active.by_name.items())
            lines.append(f"  {active.effect.name}: {numbers}" + (f" ({active.basis})" if active.basis else ""))
        if self.jitter_relative:
            lines.append(f"  motors vary by {self.jitter_relative:g} of their speed from command to command")
        if self.noise_position_m or self.noise_heading_rad:
            lines.append(f"  noise of a pose: {self.noise_position_m:g} m, {self.noise_heading_rad:g} rad")
        return "\n".join(lines)

    def __repr__(self) -> str:
        names = ", ".join(active.effect.name for active in self.effects)
        line = f"<Model: {self.name}, wheelbase {self.wheelbase_m:g} m, effects: {names or 'none'}>"
        return line if len(line) <= 200 else f"{line[:198]}…>"

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.summary())}</pre>"


class BodyModel(Model, JointedModel):
    """A body on joints in MuJoCo with the effects that are switched on; made by `bns.Model`.

    For an MJCF file also: sites (names of those that are tracked; by default all), tether (the link that carries one), and what
    MJCF does not know of servos: dead_band_rad (rad), delay_s (s), tether_drag_n (N).
    """

    def __init__(self, given: Given | None = None, /, **fields: Any) -> None:
        own = {field.name for field in dataclasses.fields(JointedModel)}
        if given is None:
            JointedModel.__init__(self, **fields)
            return
        if "wheelbase_m" in fields:
            raise ModelError(no_wheels(given))
        settings = {name: fields.pop(name) for name in list(fields) if name not in own}
        if isinstance(given, JointedModel):
            body = given
        else:
            body = load_body(fspath(given), **settings) if is_body(fspath(given)) else _of_file(fspath(given))  # type: ignore[arg-type]
        JointedModel.__init__(self, **{**{name: getattr(body, name) for name in own}, **fields})

    def summary(self) -> str:
        """The body, then one effect per line."""
        effects, joints = super().summary().split("\n")[1:], len(machine(self.mechanism).joints)
        head = f"model {self.name}: {self.base}, {joints} joints, tracked: {', '.join(self.mechanism.sites)}"
        return "\n".join([head, *effects])

    def __repr__(self) -> str:
        names = ", ".join(active.effect.name for active in self.effects)
        return f"<Model: {self.name}, {len(machine(self.mechanism).joints)} joints, effects: {names or 'none'}>"


def no_wheels(given: Given) -> str:
    """That a wheelbase was given for what has none."""
    named = given.name if isinstance(given, physics.Model) else fspath(given)
    return f"The model {named} has no wheels: leave {in_both('--wheelbase', 'wheelbase_m')} out."


def _named_from(active: physics.ActiveEffect, folder: Path) -> physics.ActiveEffect:
    """The effect with its Python file named by its name alone, where that lies in the same folder: both can be moved together."""
    file = Path(active.written.get("file", ""))
    if not file.is_absolute() or file.parent != folder:
        return active
    return dataclasses.replace(active, written={**active.written, "file": file.name})


def _names_a_body(given: Given | None) -> bool:
    if given is None or isinstance(given, physics.Model):
        return isinstance(given, JointedModel)
    path = Path(named_model(given))
    if is_body(fspath(given)):
        return True
    return path.suffix in {".yaml", ".yml"} and path.is_file() and _BODY.search(path.read_text(errors="replace")) is not None


def _of_file(path: str) -> JointedModel:
    model = load_model(path)
    assert isinstance(model, JointedModel)  # its base says so
    return model


def checked_target(path: Path) -> Path:
    """ModelError unless a model can be written there."""
    if path.suffix not in {".yaml", ".yml"}:
        raise ModelError(f"A model cannot be written to {path}; the name must end in .yaml.")
    if found := obstacle(path):
        raise ModelError(f"A model cannot be written to {path}: {found}; choose another place.")
    return path


def as_model(given: Given) -> Model:
    """A model as it is, of its name or of its file."""
    return given if isinstance(given, Model) else Model(given)


def _fields(given: Given | None, fields: dict[str, Any]) -> dict[str, Any]:
    """The fields of what is given, which those given by name replace."""
    if given is None or (isinstance(given, str) and given in BASES):
        if "wheelbase_m" not in fields:
            raise ModelError(
                f"The model {given or BASES[0]} needs its wheelbase: "
                f"{in_both('--wheelbase METRES', 'bns.Model(wheelbase_m=0.2)')}."
            )
        return {} if given is None else {"name": given}
    model = given if isinstance(given, physics.Model) else load_model(named_model(given))
    return {field.name: getattr(model, field.name) for field in dataclasses.fields(physics.Model)}
