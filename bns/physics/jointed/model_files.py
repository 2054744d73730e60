"""Bodies on joints by name, from an MJCF file, or from a model file that names one of these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bns.errors import ModelError, unknown_name
from bns.extras import extra
from bns.physics.effect import Effect, number
from bns.physics.jointed.mechanism import Mechanism
from bns.physics.jointed.model import JointedModel
from bns.physics.model import effects_and_provenance
from bns.physics.model_checks import keys
from bns.physics.snake.parameters import SnakeParameters, read_parameters, shipped_parameters
from bns.safe_yaml import Lines, shown, text_of

SNAKE = "snake"
ENDING = ".xml"
NUMBERS = {"dead_band_rad": 10.0, "delay_s": 10.0, "tether_drag_n": 10.0, "fastest_set_point_rad_s": 1e4}
"""What a model file may say of servos and tether, and MJCF does not know: the largest value of each."""
_TOP = ("base", "body", "parameters", "sites", "tether", *NUMBERS, "effects", "provenance")


def is_body(given: str) -> bool:
    """Does this name a body on joints: the snake, or an MJCF file?"""
    return given == SNAKE or given.endswith(ENDING)


def load_body(given: str, **settings: Any) -> JointedModel:
    """The snake as shipped, or the robot of an MJCF file.

    ``settings``: sites (names of the tracked sites; all by default), tether (the link that carries one) and `NUMBERS`.
    """
    return _body({"body": given, **settings}, Path(given).stem, Path())


def snake_mechanism(parameters: SnakeParameters) -> Mechanism:
    """The snake's body with its two markers."""
    with extra("snake"):
        from bns.physics.snake.model import GREEN, YELLOW, model_xml  # noqa: PLC0415  # needs MuJoCo

    p = parameters
    return Mechanism(
        model_xml(p),
        (YELLOW, GREEN),
        p.dead_band_rad,
        p.delay_s,
        f"link{p.heavy_link}",
        p.tether_drag_n,
        p.joint_speed_rad_s,
        p.settle_s,
        p.resolution_rad,
    )


def parse_body(tree: Mapping[str, Any], lines: Lines, name: str, folder: Path) -> JointedModel:
    """The model of a YAML file with ``base: mujoco``."""
    top = keys(f"model {name}", dict(tree), _TOP, required=("base", "body"))
    settings = {key: top[key] for key in ("body", "parameters", "sites", "tether", *NUMBERS) if key in top}
    bare = _body(settings, name, folder)

    def named(effect: str) -> Effect:
        return bare.effect_named(effect)

    effects, provenance = effects_and_provenance(top, lines, name, folder, named)
    return JointedModel(
        name=name, mechanism=bare.mechanism, written=bare.written, effects=effects, provenance=provenance
    )


def _body(settings: Mapping[str, Any], name: str, folder: Path) -> JointedModel:
    given = str(settings["body"])
    for key in settings:
        if key not in _TOP:
            raise ModelError(
                unknown_name("setting of a body", key, [k for k in _TOP if k not in {"base", "effects", "provenance"}])
            )
    if given == SNAKE:
        _only(settings, ("body", "parameters"), given)
        own = settings.get("parameters")
        parameters = shipped_parameters() if own is None else _snake_parameters(folder / str(own))
        written = {"body": SNAKE, **({} if own is None else {"parameters": str((folder / str(own)).resolve())})}
        return JointedModel(name=name, mechanism=snake_mechanism(parameters), written=written)
    if not given.endswith(ENDING):
        raise ModelError(f"model {name}: body is {shown(given)}; it must be {SNAKE} or an MJCF file ({ENDING}).")
    _only(settings, ("body", "sites", "tether", *NUMBERS), given)
    return _of_mjcf(folder / given, settings, name)


def _of_mjcf(path: Path, settings: Mapping[str, Any], name: str) -> JointedModel:
    with extra("snake"):
        import mujoco  # noqa: PLC0415  # other models need no MuJoCo

    if not path.is_file():
        raise ModelError(f"There is no body {path}. Give the path of an MJCF file ({ENDING}).")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        spec.compile()
        xml = spec.to_xml()
    except ValueError as error:
        raise ModelError(f"MuJoCo does not read {path}: {error}; give an MJCF file that its viewer opens.") from error
    sites = settings.get("sites", [site.name for site in spec.sites if site.name])
    if isinstance(sites, str) or not isinstance(sites, Sequence) or not sites:
        raise ModelError(
            f"model {name}: sites is {shown(sites)}; give the names of the sites that are tracked, at least one."
        )
    twice = sorted({str(site) for site in sites if list(sites).count(site) > 1})
    if twice:
        raise ModelError(f"model {name}: sites has {', '.join(twice)} more than once; name each tracked site once.")
    numbers = {key: number(f"model {name}: {key}", settings.get(key, 0.0), 0.0, most) for key, most in NUMBERS.items()}
    tether = str(settings.get("tether", ""))
    mechanism = Mechanism(xml, tuple(map(str, sites)), tether=tether, **numbers)
    written = {"body": str(path.resolve()), "sites": list(mechanism.sites), "tether": tether, **numbers}
    return JointedModel(name=name, mechanism=mechanism, written={k: v for k, v in written.items() if v})


def _snake_parameters(path: Path) -> SnakeParameters:
    return read_parameters(text_of(path, "the snake's parameters", ModelError))


def _only(settings: Mapping[str, Any], allowed: Sequence[str], given: str) -> None:
    for key in settings:
        if key not in allowed:
            raise ModelError(f"{given} takes no {key}; allowed are {', '.join(allowed[1:])}.")
