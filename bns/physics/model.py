"""A robot as physics sees it: a differential drive, the effects switched on, how much it jitters.

Models are YAML files in which every value of an effect stands beside its reason.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Any, ClassVar

from bns.errors import ModelError, in_both, unknown_name
from bns.physics.effect import Effect, number
from bns.physics.effects import all_effects, chain_key, effect_named, effect_names
from bns.physics.formula import formula_effect
from bns.physics.model_checks import flag, interval, join, keys, why
from bns.physics.order import RAMPS, is_friction_last
from bns.physics.trust import trusted_effect
from bns.safe_yaml import Lines, read_yaml, shown, text_of

BASES = ("differential-drive",)
_TOP = ("base", "wheelbase_m", "dt_s", "jitter", "noise", "effects", "provenance")
_GROUPS: Mapping[str, tuple[str, ...]] = {"jitter": ("wheel_speed_relative",), "noise": ("position_m", "heading_rad")}
_WHY = ("basis", "reason")
_EFFECT_KEYS = ("name", "values", *_WHY)
_EFFECT_MAY = ("units", "intervals", "term", "on", "file", "per_trial")

LIMITS: Mapping[str, tuple[float, float]] = {
    "wheelbase_m": (1e-3, 10.0),
    "dt_s": (1e-5, 0.1),
    "jitter_relative": (0.0, 0.5),
    "noise_position_m": (0.0, 1.0),
    "noise_heading_rad": (0.0, 1.0),
}
"""Lowest and highest allowed value of the model's own numbers."""


@dataclass(frozen=True)
class ActiveEffect:
    """An effect that is switched on, its values in the order of its parameters, and where they come from."""

    effect: Effect
    values: tuple[float, ...]
    basis: str = "guess"
    reason: str = ""
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Parameter name -> 95 % interval, where one is known."""
    written: Mapping[str, str] = field(default_factory=dict)
    """How an effect that is not in the catalogue is written down: term and on, or file."""
    per_trial: bool = False
    """Has every trial a value of its own? ``values`` then hold the mean, which stands for trials yet to come."""
    trial_values: tuple[float, ...] = ()
    """Each trial's value, in the order of the trials at hand; empty while none is known. A matter of data: never written down."""
    replaces: ActiveEffect | None = field(default=None, compare=False)
    """The simpler effect of the same model whose place it took (`Effect.extends`). `Model.without` puts that back."""

    def check(self) -> None:
        """ModelError for a value that is not allowed. Looked at once: a search makes ten thousand models of the same few."""
        if "_checked" not in self.__dict__:
            pairs = zip(self.effect.parameters, self.values, strict=True)
            if not all(type(v) is float and p.low <= v <= p.high for p, v in pairs):
                self.effect.checked(self.by_name)
            object.__setattr__(self, "_checked", True)

    def at_values(self, values: tuple[float, ...]) -> ActiveEffect:
        """The same effect at other values, which are checked; itself at its own."""
        if values == self.values:
            return self
        new = object.__new__(ActiveEffect)
        new.__dict__.update({name: held for name, held in self.__dict__.items() if name != "_checked"}, values=values)
        new.check()
        return new

    @property
    def by_name(self) -> dict[str, float]:
        """Parameter name -> value."""
        return {p.name: v for p, v in zip(self.effect.parameters, self.values, strict=True)}


@dataclass(frozen=True)
class Model:
    """Everything that decides how a differential drive moves and how it is seen.

    ``effects`` act stage by stage (wheel, body, world, measure), in one stage in the order of the tuple.
    ``dt_s`` is the longest integration step. ``jitter_relative`` is the standard deviation of each wheel's
    speed as a share of the commanded speed, drawn once a command; the noise is that of one observed pose.
    """

    wheelbase_m: float
    effects: tuple[ActiveEffect, ...] = ()
    dt_s: float = 0.005
    jitter_relative: float = 0.0
    noise_position_m: float = 0.0
    noise_heading_rad: float = 0.0
    base: str = "differential-drive"
    name: str = "unnamed"
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """How the model came to be: data and their hash, date, error before and after; free text for people."""

    friction_last: bool = field(default=True, compare=False, repr=False)
    """Of a model without friction or without ramps: whether friction acts behind ramps once both are there."""

    bases: ClassVar[tuple[str, ...]] = BASES
    """What its ``base`` may be."""

    def __post_init__(self) -> None:
        if self.base not in self.bases:
            raise ModelError(unknown_name("base", self.base, self.bases))
        for name, (low, high) in LIMITS.items():
            if type(held := getattr(self, name)) is float and low <= held <= high:
                continue
            value = number(f"model {self.name}: {name}", held, low, high)
            object.__setattr__(self, name, value)
        names = [active.effect.name for active in self.effects]
        for name in names:
            if names.count(name) > 1:
                raise ModelError(f"model {self.name} has the effect {name!r} twice; keep one of them.")
        for active in self.effects:
            active.check()
            if active.per_trial and not active.effect.per_trial_allowed:
                raise ModelError(
                    f"model {self.name}: {active.effect.name} has one value for all trials; per_trial goes with "
                    f"{join([e.name for e in all_effects().values() if e.per_trial_allowed])} alone."
                )

    def derived(self, **fields: Any) -> Model:
        """The model with other fields that are known to be allowed: nothing is checked."""
        new = object.__new__(type(self))
        new.__dict__.update(self.__dict__, **fields)
        return new

    def at(self, stage: str) -> Iterator[ActiveEffect]:
        """The effects of one stage, in order."""
        return (active for active in self.effects if active.effect.stage == stage)

    def values_of(self, name: str) -> dict[str, float]:
        """The values of an effect; the neutral ones if it is switched off."""
        for active in self.effects:
            if active.effect.name == name:
                return active.by_name
        return self.effect_named(name).neutral

    def catalogue(self) -> Mapping[str, Effect]:
        """Name -> effect that a robot of this kind can lack."""
        return all_effects()

    def effect_named(self, name: str) -> Effect:
        """The effect of that name of its catalogue; ModelError with the names there are."""
        return effect_named(name)

    def written_base(self) -> dict[str, Any]:
        """What the model file says beside effects, noise and provenance."""
        return {"base": self.base, "wheelbase_m": self.wheelbase_m, "dt_s": self.dt_s}

    def with_active(self, effect: Effect, values: tuple[float, ...]) -> Model:
        """The model with an effect object at these values, listed or not; in its place in the chain.

        One that is new and extends an effect of the model takes the place of that one, which it contains.
        """
        old = next((a for a in self.effects if a.effect.name == effect.name), None)
        parts = effect.parts if old is None else ()
        simpler = next((a for a in self.effects if a.effect.name in parts), None)
        others = tuple(a for a in self.effects if a is not old and a is not simpler)
        active = ActiveEffect(effect, values, replaces=simpler if old is None else old.replaces)
        return self._in_order((*others, active), self.is_friction_last)

    def with_effect(self, name: str, basis: str = "guess", reason: str = "", **values: float) -> Model:
        """The model with that effect switched on at these values; in its old place, else last."""
        effect = self.effect_named(name)
        active = ActiveEffect(effect, effect.checked(values), basis, reason)
        if all(a.effect.name != name for a in self.effects):
            return replace(self, effects=(*self.effects, active))
        return replace(self, effects=tuple(active if a.effect.name == name else a for a in self.effects))

    @property
    def per_trial_effect(self) -> ActiveEffect | None:
        """The effect that has another value in every trial; None if there is none."""
        return next((active for active in self.effects if active.per_trial), None)

    def with_trial_values(self, trial_values: Iterable[float]) -> Model:
        """The model with these values of its `per_trial_effect` effect, one a trial; their mean stands for other trials."""
        values = tuple(float(v) for v in trial_values)
        mean = (sum(values) / len(values),)
        changed = tuple(replace(a, values=mean, trial_values=values) if a.per_trial else a for a in self.effects)
        return replace(self, effects=changed)

    def with_values(self, values: Mapping[str, Mapping[str, float]]) -> Model:
        """The model with other values of effects that are switched on; bounds are the caller's business."""
        changed = tuple(
            a.at_values(tuple(values[a.effect.name][p.name] for p in a.effect.parameters)) if a.effect.name in values else a
            for a in self.effects
        )
        return self.derived(effects=changed)

    @property
    def is_friction_last(self) -> bool:
        """Whether friction acts behind ramps (`bns.physics.order`): by the order of the effects, where both are there."""
        found = is_friction_last([active.effect.name for active in self.effects])
        return self.friction_last if found is None else found

    def arranged(self) -> Model:
        """The model with its effects in the order in which they act; those of packages that share a place, by name."""
        return self._in_order(self.effects, self.is_friction_last)

    def with_friction_moved(self) -> Model | None:
        """The model with friction on the other side of its ramps; None where one of the two is not there."""
        if is_friction_last([active.effect.name for active in self.effects]) is None:
            return None
        return self._in_order(self.effects, not self.is_friction_last)

    def _in_order(self, effects: Iterable[ActiveEffect], friction_last: bool) -> Model:
        effects = tuple(effects)
        arranged = tuple(sorted(effects, key=lambda a: _key(a.effect, effects, friction_last)))
        for active in arranged:
            active.check()
        return self.derived(effects=arranged, friction_last=friction_last)

    def key_of(self, effect: Effect) -> tuple[float, str]:
        """Where an effect acts, or would act, beside those of the model (`chain_key`)."""
        return _key(effect, self.effects, self.is_friction_last)

    def without(self, name: str) -> Model:
        """The model with that effect switched off; with the simpler one again whose place it took."""
        if all(a.effect.name != name for a in self.effects):
            self.effect_named(name)
        kept = tuple(a for a in self.effects if a.effect.name != name)
        rest = replace(self, effects=kept, friction_last=self.is_friction_last)
        back = next((a.replaces for a in self.effects if a.effect.name == name), None)
        if back is None:
            return rest
        name = back.effect.name
        heir = next((a for a in rest.effects if name in a.effect.parts and not a.replaces), None)
        if heir is None:
            return rest._in_order((*rest.effects, back), self.is_friction_last)
        return replace(rest, effects=tuple(replace(a, replaces=back) if a is heir else a for a in rest.effects))

    def canonical_json(self) -> str:
        """All that changes numbers, as JSON with sorted keys; neither the model's name nor the reasons."""
        numbers: dict[str, Any] = {field: getattr(self, field) for field in LIMITS}
        listed = [[a.effect.name, a.by_name, *([dict(a.written)] if a.written else [])] for a in self.effects]
        numbers |= {"base": self.base, "effects": listed}
        if revised := {a.effect.name: a.effect.revision for a in self.effects if a.effect.revision > 1}:
            numbers |= {"revisions": revised}
        return json.dumps(numbers, sort_keys=True, separators=(",", ":"))

    @property
    def digest(self) -> str:
        """SHA-256 of `canonical_json`, 20 hexadecimal digits."""
        return hashlib.sha256(self.canonical_json().encode()).hexdigest()[:20]


def _key(effect: Effect, beside: Iterable[ActiveEffect], friction_last: bool) -> tuple[float, str]:
    """`chain_key`; where no ramp is beside an effect, friction has its own place."""
    return chain_key(effect, friction_last and any(active.effect.name in RAMPS for active in beside))


def model_names() -> list[str]:
    """The models that come with the package."""
    folder = resources.files("bns.physics")
    return sorted(Path(f.name).stem for f in folder.iterdir() if f.name.endswith(".yaml"))


def _names() -> list[str]:
    """All names that a command takes for a model: those of the package, the plain drive, and the snake."""
    return [*model_names(), *BASES, "snake"]


def load_model(name_or_path: str | Path) -> Model:
    """A model of the package by its name, or any YAML file by its path (with .yaml or .yml at the end).

    ModelError if there is none, or if it has an unknown key, effect or parameter or a value out of bounds.
    """
    path = Path(name_or_path)
    if path.suffix in {".yaml", ".yml"}:
        if not path.is_file():
            raise ModelError(f"There is no model file {path}. Give the path of a YAML file or one of: {', '.join(_names())}.")
        text = text_of(path, "the model", ModelError)
        try:
            return parse_model(text, path.stem, path.parent)
        except ModelError as fault:
            raise type(fault)(f"{path}: {fault}") from fault
    if str(name_or_path) not in model_names():
        if path.is_file():
            raise ModelError(
                f"{path} is no model: a model is the path of a YAML file (.yaml) or one of {', '.join(_names())}. If it is a "
                "log, give it first and the model after it: bns diagnose LOG --model MODEL."
            )
        known = unknown_name("robot model", str(name_or_path), _names())
        raise ModelError(
            f"{known} Or give the path of a YAML file, with .yaml at its end. {BASES[0]} also needs "
            f"{in_both('--wheelbase METRES', 'bns.Model(wheelbase_m=METRES)')}."
        )
    text = (resources.files("bns.physics") / f"{name_or_path}.yaml").read_text(encoding="utf-8")
    return parse_model(text, str(name_or_path))


def parse_model(text: str, name: str, folder: Path | None = None) -> Model:
    """The model in a YAML text; ``name`` is for messages, effects in Python files are sought from ``folder``.

    No Python file is run but those that are trusted (`bns.physics.trust`).
    """
    tree, lines = read_yaml(text, f"model {name}", ModelError)
    if tree is None:
        raise ModelError(f"The file of model {name} is empty; it needs at least base and wheelbase_m (docs/missing-effect.md).")
    if isinstance(tree, dict) and tree.get("base") == "mujoco":
        from bns.physics.jointed.model_files import parse_body  # noqa: PLC0415  # it needs MuJoCo, and knows this module

        return parse_body(tree, lines, name, folder or Path())
    top = keys(f"model {name}", tree, _TOP, required=("base", "wheelbase_m"))
    for key in ("wheelbase_m", "dt_s"):
        with lines.at(key):
            number(f"model {name}: {key}", top.get(key, Model.dt_s), *LIMITS[key])
    jitter, noise = (_group(name, top, key, lines) for key in _GROUPS)
    effects, provenance = effects_and_provenance(top, lines, name, folder or Path(), effect_named)
    return Model(
        name=name,
        base=top["base"],
        wheelbase_m=top["wheelbase_m"],
        dt_s=top.get("dt_s", Model.dt_s),
        jitter_relative=jitter["wheel_speed_relative"],
        noise_position_m=noise["position_m"],
        noise_heading_rad=noise["heading_rad"],
        effects=effects,
        provenance=provenance,
    )


def effects_and_provenance(
    top: Mapping[str, Any], lines: Lines, name: str, folder: Path, named: Callable[[str], Effect]
) -> tuple[tuple[ActiveEffect, ...], dict[str, Any]]:
    """What model files of all bases share; ``named`` finds a listed effect."""
    listed = top.get("effects") or []
    if not isinstance(listed, list):
        raise ModelError(
            f"model {name}: effects is {shown(listed)}; it must be a list with an entry for each effect: "
            "- {name: motor-lag, values: {tau_s: 0.1}, basis: guess, reason: why it is what it is}."
        )
    provenance = top.get("provenance") or {}
    if not isinstance(provenance, dict):
        raise ModelError(f"provenance of model {name} is {shown(provenance)}; it must be a mapping (lines of key: value).")
    effects = []
    for at, entry in enumerate(listed):
        with lines.at("effects", at):
            effects.append(_effect(name, entry, folder, named))
    return tuple(effects), provenance


def _effect(model: str, entry: Any, folder: Path, named: Callable[[str], Effect]) -> ActiveEffect:
    where = f"an effect of model {model}"
    if isinstance(entry, dict) and "name" in entry and not {"term", "on", "file"} & entry.keys():
        named(str(entry["name"]))  # a name that does not exist is said before keys that are not there
    given = keys(where, entry, (*_EFFECT_KEYS, *_EFFECT_MAY), required=_EFFECT_KEYS)
    written: dict[str, str] = {str(key): str(given[key]) for key in ("term", "on", "file") if key in given}
    numbers = given["values"] if isinstance(given["values"], dict) else {}
    effect = _written_effect(where, str(given["name"]), written, folder, named, map(str, numbers))
    names = tuple(p.name for p in effect.parameters)
    values = keys(f"values of {effect.name} in model {model}", given["values"], names)
    intervals = keys(f"intervals of {effect.name} in model {model}", given.get("intervals") or {}, names)
    return ActiveEffect(
        effect,
        effect.checked(values),
        *why(f"{effect.name} in model {model}", given),
        intervals={
            name: interval(f"the interval of {name}, {effect.name} in model {model},", ends)
            for name, ends in intervals.items()
        },
        written=written,
        per_trial=flag(f"per_trial of {effect.name} in model {model}", given.get("per_trial", False)),
    )


def _written_effect(
    where: str,
    name: str,
    written: Mapping[str, str],
    folder: Path,
    named: Callable[[str], Effect],
    numbers: Iterable[str],
) -> Effect:
    """The effect of that name: from the catalogue, a formula, or a Python file with an ``EFFECT``."""
    if "file" in written:
        return trusted_effect(folder / written["file"], f"{where}, {name},")
    if not written:
        return named(name)
    if set(written) != {"term", "on"}:
        raise ModelError(f"{where}, {name}: a formula needs both term and on (term: k * v * abs(w), on: v).")
    if name in effect_names():
        raise ModelError(f"{where}: {name} is the name of a listed effect; give the formula another one.")
    return formula_effect(name, written["term"], written["on"], numbers=numbers)


def _group(model: str, top: Mapping[str, Any], key: str, lines: Lines) -> dict[str, Any]:
    """The numbers of jitter or noise; all 0 where the file says nothing."""
    if key not in top:
        return dict.fromkeys(_GROUPS[key], 0.0)
    where = f"{key} of model {model}"
    with lines.at(key):
        group = keys(where, top[key], (*_GROUPS[key], *_WHY), required=(*_GROUPS[key], *_WHY))
        why(where, group)
    return group


