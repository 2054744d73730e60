"""Simulator networks in files: safetensors with their meaning beside the numbers, and as torch modules.

A file holds for each network ``<network>.hidden.weight`` (H, 5), ``<network>.hidden.bias`` (H,),
``<network>.output.weight`` (1, H) and ``<network>.output.bias`` (1,), which are the names in the torch modules. Networks of a
run bring ``training.inputs`` (patterns, 5) along: where they had data.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from bns.engine.snn import INPUTS, PER_NEURON, hidden_count
from bns.errors import ModelError
from bns.extras import extra
from bns.robots import load_robot
from bns.spec import robot_and_options
from bns.targets import obstacle

if TYPE_CHECKING:
    import torch

_TRAINING = "training.inputs"


@dataclass(frozen=True)
class StaticSimulator:
    """Networks (networks, W) float32, standard deviations (networks,) of their residuals in SI, and where they come from."""

    networks: tuple[str, ...]
    weights: np.ndarray
    noise_sd: np.ndarray
    provenance: dict[str, Any] = field(default_factory=dict)
    learned_from: np.ndarray = field(default_factory=lambda: np.empty((INPUTS, 0), np.float32))
    """Inputs (5, patterns) of the patterns that the networks were trained on; none where these were not kept."""

    @property
    def digest(self) -> str:
        """Hash of the numbers that decide what a substitute world answers."""
        return (
            "w" + hashlib.sha256(self.weights.tobytes() + self.noise_sd.astype(np.float64).tobytes()).hexdigest()[:15]
        )


def tensors(networks: tuple[str, ...], weights: np.ndarray) -> dict[str, np.ndarray]:
    """The weights (networks, W) under the names that the torch modules use."""
    named = {}
    for name, row in zip(networks, weights, strict=True):
        neurons = row[:-1].reshape(-1, PER_NEURON)
        named[f"{name}.hidden.weight"] = np.ascontiguousarray(neurons[:, :INPUTS])
        named[f"{name}.hidden.bias"] = np.ascontiguousarray(neurons[:, INPUTS])
        named[f"{name}.output.weight"] = np.ascontiguousarray(neurons[None, :, INPUTS + 1])
        named[f"{name}.output.bias"] = row[-1:].copy()
    return named


def from_tensors(networks: tuple[str, ...], named: dict[str, np.ndarray]) -> np.ndarray:
    """The inverse of `tensors`: weights (networks, W) float32; ModelError names a tensor that is missing or has another shape."""
    rows = []
    for name in networks:
        parts = [
            _part(named, f"{name}.{part}") for part in ("hidden.weight", "hidden.bias", "output.weight", "output.bias")
        ]
        hidden = parts[0].shape[0] if parts[0].ndim == 2 else 0
        expected = ((hidden, INPUTS), (hidden,), (1, hidden), (1,))
        for part, shape in zip(parts, expected, strict=True):
            if part.shape != shape or hidden == 0 or hidden % 4:
                raise ModelError(
                    f"network {name!r} has a tensor of shape {part.shape}; expected {INPUTS} inputs, a number of hidden "
                    "neurons that is a multiple of 4, and one output."
                )
        neurons = np.column_stack([parts[0], parts[1], parts[2][0]])
        rows.append(np.concatenate([neurons.ravel(), parts[3]]))
    return np.asarray(rows, np.float32)


def _part(named: dict[str, np.ndarray], name: str) -> np.ndarray:
    if name not in named:
        raise ModelError(f"there is no tensor {name!r}; found: {', '.join(sorted(named))}.")
    return np.asarray(named[name], np.float32)


def save_simulator(simulator: StaticSimulator, path: Path) -> None:
    """Write a safetensors file with the provenance in its header."""
    about = {
        "format": "bns-snn-1",
        "networks": list(simulator.networks),
        "noise_sd": [float(sd) for sd in simulator.noise_sd],
        "provenance": simulator.provenance,
    }
    header = {"bns": json.dumps(about, sort_keys=True)}  # one entry: safetensors writes several in any order
    numbers = tensors(simulator.networks, simulator.weights)
    if simulator.learned_from.size:
        numbers[_TRAINING] = np.ascontiguousarray(simulator.learned_from.T, np.float32)
    data = save(numbers, metadata=header)
    check_writable(path)
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_bytes(data)
        part.replace(path)
    except OSError as error:
        raise ModelError(f"cannot write {path}: {error.strerror}; choose another file.") from error


def check_writable(path: Path) -> None:
    """ModelError if no file can be written there; makes its folder."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ModelError(f"cannot make the folder of {path}: {error.strerror}; choose another file.") from error
    if found := obstacle(path):
        raise ModelError(f"cannot write {path}: {found}; choose another file.")


def load_simulator(path: Path | str) -> StaticSimulator:
    """Read such a file; ModelError if it is missing or something else."""
    path = Path(path)
    if not path.is_file():
        raise ModelError(f"there is no network file {path}.")
    try:
        with safe_open(str(path), framework="numpy") as file:
            header = file.metadata() or {}
            named = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118  # not a dict
    except (SafetensorError, OSError, TypeError, ValueError, MemoryError) as error:
        raise ModelError(f"{path} is no safetensors file that bns reads: {error}.") from error
    if "bns" not in header:
        raise ModelError(f"{path} does not say which networks it holds; write it with bns (`bns run --save-snn FILE`).")
    networks, noise_sd, provenance = _about(path, header["bns"])
    learned_from = _part(named, _TRAINING) if _TRAINING in named else np.empty((0, INPUTS), np.float32)
    if learned_from.ndim != 2 or learned_from.shape[1] != INPUTS:
        raise ModelError(f"{path} has {_TRAINING} of shape {learned_from.shape}; expected (patterns, {INPUTS}).")
    weights = from_tensors(networks, named)
    if not (np.isfinite(weights).all() and np.isfinite(learned_from).all()):
        raise ModelError(f"{path} holds weights or patterns that are no finite numbers; write it again.")
    return StaticSimulator(networks, weights, noise_sd, provenance, learned_from.T)


def _about(path: Path, text: str) -> tuple[tuple[str, ...], np.ndarray, dict[str, Any]]:
    """Names of the networks, standard deviations of their noise, and provenance, as a file's header has them."""
    try:
        about = json.loads(text)
        names, noise_sd = tuple(about["networks"]), np.asarray(about["noise_sd"], np.float64)
        provenance = dict(about["provenance"])
    except (ValueError, TypeError, LookupError, RecursionError) as error:
        raise ModelError(f"{path} does not say which networks it holds ({error}); write it again with bns.") from error
    if not names or not all(isinstance(name, str) for name in names) or not np.isfinite(noise_sd).all() or noise_sd.ndim != 1:
        raise ModelError(f"{path} names no networks, or noise that is no number, in its header; write it again with bns.")
    return names, noise_sd, provenance


def static_path(robot: str) -> Path:
    """Where the static simulator of a robot lies in the robot's package; SpecError if there is no such robot."""
    base = robot_and_options(robot)[0]
    return Path(str(resources.files(load_robot(base).simulators) / "data" / f"{robot}.safetensors"))


@cache
def load_static_simulator(robot: str) -> StaticSimulator:
    """The static simulator that the substitute world answers with; ModelError says how to make it if it is missing."""
    path = static_path(robot)
    if not path.is_file():
        raise ModelError(
            f"the static simulator of {robot} is missing ({path}); make it: bns precompute --robot {robot}"
        )
    simulator = load_simulator(path)
    simulator.weights.setflags(write=False)
    return simulator


def to_torch(networks: tuple[str, ...], weights: np.ndarray) -> torch.nn.ModuleDict:
    """The networks as torch modules, float32: inputs and outputs are the normalised ones of the robot."""
    with extra("torch"):
        import torch  # noqa: PLC0415  # a second to import, and a run does not need it

    def module(hidden: int) -> torch.nn.Module:
        layers = {
            "hidden": torch.nn.Linear(INPUTS, hidden),
            "sigmoid": torch.nn.Sigmoid(),
            "output": torch.nn.Linear(hidden, 1),
        }
        net = torch.nn.Sequential()
        for name, layer in layers.items():
            net.add_module(name, layer)
        return net

    modules = torch.nn.ModuleDict({name: module(hidden_count(weights.shape[1])) for name in networks})
    modules.load_state_dict({name: torch.from_numpy(value) for name, value in tensors(networks, weights).items()})
    return modules


def from_torch(modules: torch.nn.ModuleDict) -> np.ndarray:
    """Weights (networks, W) of modules as `to_torch` makes them."""
    named = {name: value.detach().cpu().numpy() for name, value in modules.state_dict().items()}
    return from_tensors(tuple(modules.keys()), named)
