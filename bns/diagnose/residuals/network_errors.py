"""Why a run's networks are wrong: their data are thin, or their inputs cannot know.

Commands that lie among the training patterns are told from those that lie outside. What goes wrong outside, beyond what goes
wrong among them, is laid to thin data. Among them, what the five inputs explain (a kernel regression, on trials held out) was not
learned though it could have been; what other variables explain beyond that, the inputs cannot know; the rest is scatter.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.cross_validation import FOLDS, whole_trials
from bns.diagnose.estimate.significance import sign_flip_p
from bns.diagnose.predict.networks import NetworkPredictor
from bns.diagnose.residuals.missing_inputs import Commands, MissingInput, find_missing_inputs
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.physics.model import Model

NEIGHBOURS = DEFAULTS.residuals.neighbours
USUAL = DEFAULTS.residuals.usual_share
FEWEST = DEFAULTS.residuals.fewest_commands
FEWEST_TRIALS = DEFAULTS.residuals.fewest_trials
DRAWS = DEFAULTS.residuals.sparse_draws
LEAST_SPARSE = DEFAULTS.residuals.sparse_least
MEMORY_S = DEFAULTS.residuals.memory_s
_INPUTS = (
    "left_m_s",
    "right_m_s",
    "speed_m_s",
    "wheel_difference_m_s",
    "previous_speed_m_s",
    "previous_wheel_difference_m_s",
)
_MEANINGLESS = ("time_in_command_s", "left_since_reversal_s", "right_since_reversal_s")
"""Where only ends of commands are seen, these are the same everywhere, or known from the inputs."""
_CHANCE = DEFAULTS.residuals.sparse_chance


@dataclass(frozen=True)
class SparseCoverage:
    """Commands outside the training patterns: how many, how many times the squared error of the others they show, and the ends of
    the 95 % interval of that (bootstrap over trials)."""

    commands: int
    ratio: float
    low: float
    high: float

    @property
    def matters(self) -> bool:
        """Whether the error is larger there beyond doubt."""
        return self.commands > 0 and self.low > 1.0


@dataclass(frozen=True)
class NetworkErrors:
    """Where the squared error of networks comes from. ``share``: of thin data, unlearned, unknowable and scatter, summing to 1;
    empty where too few commands lie among the patterns. ``distance`` (n,) to the patterns, ``radius`` up to which they are near,
    ``size`` (n,) of each command's error as root mean square of the outputs."""

    commands: Commands
    patterns: int
    radius: float
    distance: Array
    size: Array
    sparse_coverage: SparseCoverage
    share: Mapping[str, float]
    missing_inputs: tuple[MissingInput, ...]
    alone: tuple[MissingInput, ...]

    @property
    def verdict(self) -> tuple[str, ...]:
        """What holds of ``thin-data``, ``inputs-cannot-know``; ``neither``; or ``insufficient-data``."""
        if not self.share:
            return ("insufficient-data",)
        causes = ["thin-data"] * (self.share["thin data"] > LEAST_SPARSE) + ["inputs-cannot-know"] * bool(
            self.missing_inputs
        )
        return tuple(causes) or ("neither",)

    def as_json(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "verdict": list(self.verdict),
            "training_patterns": self.patterns,
            "commands": len(self.distance),
            "near_distance": self.radius,
            "outside": {**asdict(self.sparse_coverage), "matters": self.sparse_coverage.matters}
            if self.share
            else {"commands": self.sparse_coverage.commands},
            "share": dict(self.share),
            "missing_inputs": [asdict(one) for one in self.missing_inputs],
            "alone": [asdict(one) for one in self.alone],
        }


def why_wrong(predictor: NetworkPredictor, seed: int = 0) -> NetworkErrors:
    """Take the errors of whole commands apart; ``seed`` draws the bootstrap.

    DataError if the networks' training patterns were not kept, or no command was tracked at both ends.
    """
    if predictor.learned_from.shape[1] <= NEIGHBOURS:
        raise DataError(
            f"The networks come with {predictor.learned_from.shape[1]} training patterns, so it is not known where their data "
            "are thin; write networks with: bns run --save-snn FILE."
        )
    inputs, commands = _commands(predictor)
    distance, radius = nearness(inputs, predictor.learned_from.T.astype(np.float64))
    near, square = distance <= radius, (commands.error**2).mean(axis=1)
    sparse_coverage = _sparse_coverage(square, near, commands.trial, np.random.default_rng(seed))
    share: dict[str, float] = {}
    named: list[MissingInput] = []
    alone: list[MissingInput] = []
    if near.sum() >= FEWEST and len(np.unique(commands.trial[near])) >= FEWEST_TRIALS:
        among = _only(commands, near)
        after, gained = _beyond_inputs(inputs[near], among)
        named, alone, explained = find_missing_inputs(after)
        kept = 1.0 - gained
        outside = (
            float(max(square.sum() - len(square) * square[near].mean(), 0.0) / square.sum())
            if sparse_coverage.matters
            else 0.0
        )
        among_share = 1.0 - outside
        share = {"thin data": outside, "unlearned": among_share * gained, "unknowable": among_share * kept * explained}
        share["scatter"] = 1.0 - sum(share.values())
    return NetworkErrors(
        commands,
        predictor.learned_from.shape[1],
        radius,
        distance,
        np.sqrt(square),
        sparse_coverage,
        share,
        tuple(named),
        tuple(alone),
    )


def nearness(inputs: Array, patterns: Array) -> tuple[Array, float]:
    """Mean distance (n,) of inputs (n, 5) to the nearest of the distinct patterns (m, 5), and how far is usual among these."""
    from scipy.spatial import cKDTree  # noqa: PLC0415  # slow to load

    distinct = np.unique(patterns, axis=0)
    tree = cKDTree(distinct)
    neighbours = min(NEIGHBOURS, len(distinct) - 1)
    if neighbours < 1:
        raise DataError(
            "The networks were trained on one command only, so it is not known where their data are thin."
        )
    own = tree.query(distinct, k=neighbours + 1)[0][:, 1:].mean(axis=1)
    asked = np.reshape(tree.query(inputs, k=neighbours)[0], (len(inputs), neighbours)).mean(axis=1)
    return asked, float(np.quantile(own, USUAL))


def _commands(predictor: NetworkPredictor) -> tuple[Array, Commands]:
    """Inputs (n, 5) and errors of all commands that were tracked at both ends."""
    tracks, robot, node = predictor.tracks, predictor.robot, predictor.node
    end = np.flatnonzero(~tracks.is_first & (node == np.roll(node, 1) + 1))
    if not len(end):
        raise DataError("No command was tracked at both ends; log the pose before and after each command.")
    trial, which = tracks.trial[end], node[end] - 1
    lists = [predictor.commands(i) for i in range(len(tracks))]
    inputs = np.concatenate([robot.inputs(one).T for one in lists]).astype(np.float64)
    first = np.concatenate([[0], np.cumsum([len(one) for one in lists])])
    row = first[trial] + which
    duration = np.concatenate([robot.wheel_speeds_m_s(one)[2] for one in lists])[row]  # type: ignore[attr-defined]  # as above
    told = predictor.steps(Model(wheelbase_m=1.0)).body[end]
    error = predictor.measured()[end] - told
    variables = {
        name: values for name, values in predictor.at_frames(end - 1).items() if name not in (*_INPUTS, *_MEANINGLESS)
    }
    variables["heading_rad"] = variables["heading_rad"] + told[:, 2] / 2  # halfway through the command
    variables |= {name: values[row] for name, values in _kept(predictor, lists).items()}
    whole = whole_trials(tracks)  # pieces of one trial share what was peculiar to it
    own = whole[trial] if whole[-1] > 0 else trial
    commands = Commands(own, duration, _outputs(predictor, told), _outputs(predictor, error), variables)
    return inputs[row], commands


def _kept(predictor: NetworkPredictor, lists: list[Array]) -> dict[str, Array]:
    """Speed and wheel difference that a robot slow by `MEMORY_S` would still have, at the begin of each command, of what it was
    told before the previous one: the inputs know the previous command, but not how long it lasted, nor what was before."""
    out = []
    for commands in lists:
        left, right, lasting = predictor.robot.wheel_speeds_m_s(commands)  # type: ignore[attr-defined]  # differential drive
        told = np.column_stack([(left + right) / 2, right - left])
        kept = np.zeros_like(told)
        for k in range(1, len(told)):
            before = told[k - 2] if k >= 2 else np.zeros(2)
            kept[k] = (kept[k - 1] + before - told[k - 1]) * np.exp(-lasting[k - 1] / MEMORY_S)
        out.append(kept)
    speed, difference = np.concatenate(out).T
    return {"speed_kept_m_s": speed, "wheel_difference_kept_m_s": difference}


def _outputs(predictor: NetworkPredictor, body: Array) -> Array:
    """Forward, left, turn (n, 3) in units of the networks' outputs: the error that training makes small."""
    displaced = np.column_stack([-body[:, 1], body[:, 0], body[:, 2]])
    return np.asarray(predictor.robot.targets(displaced), dtype=np.float64).T


def _only(commands: Commands, kept: NDArray[np.bool_]) -> Commands:
    return Commands(
        commands.trial[kept],
        commands.duration_s[kept],
        commands.predicted[kept],
        commands.error[kept],
        {name: values[kept] for name, values in commands.variables.items()},
    )


def _sparse_coverage(
    square: Array, near: NDArray[np.bool_], trial: NDArray[np.int64], rng: np.random.Generator
) -> SparseCoverage:
    outside = int((~near).sum())
    if outside == 0 or near.sum() == 0:
        return SparseCoverage(outside, float("nan"), float("nan"), float("nan"))
    sums = np.zeros((int(trial.max()) + 1, 4))
    np.add.at(sums, trial, np.column_stack([square * ~near, ~near, square * near, near]))
    drawn = rng.multinomial(len(sums), np.full(len(sums), 1 / len(sums)), size=DRAWS) @ sums
    whole = drawn[(drawn[:, 1] > 0) & (drawn[:, 3] > 0)]
    low, high = np.quantile((whole[:, 0] / whole[:, 1]) / (whole[:, 2] / whole[:, 3]), [0.025, 0.975])
    return SparseCoverage(outside, float(square[~near].mean() / square[near].mean()), float(low), float(high))


def _beyond_inputs(inputs: Array, commands: Commands) -> tuple[Commands, float]:
    """Errors less what the inputs tell of them on trials held out, and the share of the squared error that this is; nothing is
    taken off where it may be luck."""
    from sklearn.kernel_ridge import KernelRidge  # noqa: PLC0415  # slow to load

    best, told = 0.0, np.zeros_like(commands.error)
    whole = float((commands.error**2).sum())
    for penalty in (0.1, 1.0, 10.0):
        guess = np.zeros_like(commands.error)
        for fold in range(FOLDS):
            held = commands.trial % FOLDS == fold
            if held.any() and not held.all():
                learner = KernelRidge(kernel="rbf", gamma=0.5, alpha=penalty).fit(inputs[~held], commands.error[~held])
                guess[held] = learner.predict(inputs[held])
        gains = (commands.error**2 - (commands.error - guess) ** 2).sum(axis=1)
        by_trial = np.bincount(commands.trial, gains)[np.unique(commands.trial)].astype(np.float64)
        share = float(by_trial.sum()) / whole if whole > 0 else 0.0
        luck = sign_flip_p(by_trial[:, None], np.array([[float(by_trial @ by_trial) or 1.0]]))
        if share > best and luck < _CHANCE:
            best, told = share, guess
    return Commands(
        commands.trial, commands.duration_s, commands.predicted, commands.error - told, commands.variables
    ), best
