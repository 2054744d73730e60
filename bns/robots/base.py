"""What the loop asks of a robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from bns.tasks import Task

if TYPE_CHECKING:  # half a second to load, and a run needs no table
    import pandas as pd

if TYPE_CHECKING:  # whoever only asks for the robots' names does not wait for the compiler
    from bns.engine.evolution import CommandBounds, Population
    from bns.engine.philox import Key


class Scores(NamedTuple):
    """Per controller: fitness (n,), 0 where the arithmetic failed; goals reached (n,); how many failed; and, where a robot
    says so, how many of its commands count (n,), and what its networks said of all commands (networks, commands)."""

    fitness: np.ndarray
    goals_reached: np.ndarray
    failures: int
    used: np.ndarray | None = None
    outputs: np.ndarray | None = None


class RandomStream(NamedTuple):
    """Which draws a noisy evaluation takes."""

    key: Key
    step: int


class StagedTraining(NamedTuple):
    """How a static simulator is made where random commands alone do not do: worst patterns are driven again, with variants."""

    random: int
    """Commands drawn at random, each driven by itself."""
    worst: int
    """Worst patterns of each network that are driven again."""
    variants: int
    """Further commands near each of them."""
    evolved_worst: int
    """Worst commands of controllers evolved on the simulator, driven again likewise."""
    evolved_variants: int
    iterations: int
    """Iterations of the last training; it ends earlier where patterns that are only watched get worse."""
    noise_sd: tuple[float, ...]
    """Standard deviations of the substitute world, SI, a network."""
    evolving: tuple[str, ...] = ()
    """Options of the robot that are on while controllers evolve on the static simulator."""


class Commands(Protocol):
    """What a robot can be told: commands (n, components) in its own units."""

    bounds: CommandBounds
    command_columns: tuple[str, ...]

    def initial_population(self, key: Key, size: int, shortest: int, capacity: int) -> Population:
        """A random population."""

    def random_controllers(self, key: Key, count: int, length: int) -> Population:
        """Random controllers that all have the same number of commands."""

    def perturb(self, commands: np.ndarray, key: Key, step: int) -> np.ndarray:
        """Allowed commands (n, components) as far from these as a mutation can go."""

    def plan(
        self, controller: np.ndarray, weights: np.ndarray | None, task: Task, stream: RandomStream | None = None
    ) -> np.ndarray:
        """The commands (m, components) that are driven when this controller is picked; stream: the draws it was scored with.
        All of them where no networks (None) say how many the task needs."""

    def driven_ms(self, commands: np.ndarray) -> float:
        """How long these commands drive, in milliseconds."""


class CommandFiles(Protocol):
    """Commands that a user wrote in a file, to be driven as they are."""

    given_columns: Mapping[str, tuple[float, float]]
    """Columns, SI, of such a file; the lowest and the highest value allowed."""

    def parse_commands(self, rows: np.ndarray) -> np.ndarray:
        """Commands (n, components) of rows (n, `given_columns`) within their limits; SpecError for one that is none."""


class Evolution(Protocol):
    """How controllers are bred."""

    def breed(
        self,
        key: Key,
        parents: Population,
        order: np.ndarray,
        cdf: np.ndarray,
        rate: float,
        shortest: int,
        generation: int,
        children: Population,
    ) -> int:
        """The next generation into `children`; how many of them were cut at the longest list allowed."""

    def diversity(self, population: Population, scores: Scores) -> float:
        """Diversity of a population that was scored."""


class Networks(Protocol):
    """The simulator networks of a robot: what goes in, what comes out, and how they are made."""

    networks: tuple[str, ...]
    hidden: int
    input_count: int
    """Inputs that the networks have, up to five."""
    sigmoid_output: bool
    nguyen_widrow: bool
    """Whether untrained networks are drawn as Nguyen and Widrow did."""
    flat_spot: float
    """Added to the slope of a sigmoid in training."""
    recipe: StagedTraining | None
    """None: the static simulator learns from random controllers, and its noise is that of its residuals."""
    repeats_inputs: bool
    """Whether the same inputs come up again and again, so that training gains by taking them together."""

    def inputs(self, commands: np.ndarray) -> np.ndarray:
        """Normalised network inputs (inputs, n) float32 of one controller's commands (n, components)."""

    def displacements(self, outputs: np.ndarray) -> np.ndarray:
        """Displacements (n, networks), SI, in the robot's frame, of network outputs (networks, n)."""

    def targets(self, displacements: np.ndarray) -> np.ndarray:
        """The inverse of `displacements`: network targets (networks, n) float32."""

    def learnable(self, displacements: np.ndarray) -> np.ndarray:
        """Which displacements (n, networks) each network may learn from, bool (networks, n)."""


class Kinematics(Protocol):
    """From displacements to poses (n, columns) and back."""

    def start_pose(self) -> np.ndarray:
        """Pose (1, columns) of a robot that has not moved yet."""

    def poses(self, displacements: np.ndarray, commands: np.ndarray | None = None) -> np.ndarray:
        """Poses (n, columns) after each displacement, from the start of every task; ``commands`` (n, components), which led to
        them, where what lies between two commands is simulated too."""

    def measured_displacements(self, poses: np.ndarray) -> np.ndarray:
        """Displacements (n, networks) between measured poses, the first from the start."""

    def transform(self, poses: np.ndarray, turn_rad: float, shift_m: np.ndarray) -> np.ndarray:
        """Poses (n, columns) turned about the origin, counter-clockwise, and then shifted by (2,)."""


class Fitness(Protocol):
    """How well a controller does at a task."""

    radii_m: tuple[float, ...]
    """At which success is recorded, the one that fitness counts first. A robot that heeds ``Task.radius_m`` and any
    ``region_m`` when it scores says so by ``narrows_goals = True``; one that can score under noise that is told to it has
    ``expected``, as the Khepera (`bns.approaches.bns` asks for both)."""

    def score(
        self, population: Population, weights: np.ndarray, task: Task, stream: RandomStream | None = None,
        parents: Scores | None = None,
    ) -> Scores:
        """Fitness of every controller on simulator networks (networks, W); stream is for robots with noise in evolution.

        parents: scores of the generation that this one was bred from, on the same networks: a robot may take over from them
        what cannot have changed. The scores are the same with them and without.
        """

    def walk(
        self, population: Population, displacements: np.ndarray, task: Task, stream: RandomStream | None = None
    ) -> Scores:
        """Fitness of every controller from the displacements (commands, networks) of all their commands, list after list,
        whatever simulator foretold them: `score` without its networks."""

    def evaluate_path(self, poses: np.ndarray, task: Task) -> tuple[float, int]:
        """Fitness and goals reached of one driven path (n, columns)."""

    def succeeded(self, poses: np.ndarray, task: Task) -> bool:
        """Whether a driven path counts as success."""

    def successes(self, poses: np.ndarray, task: Task) -> tuple[bool, ...]:
        """Whether the path visits all goals in order, for each of `radii_m`."""


class Stability(Protocol):
    """What a person who watches can say of a drive."""

    marks_unstable: bool
    """Can a command be unstable, so that whoever watches is asked for it?"""

    def marked_unstable(self, poses: np.ndarray, commands: Sequence[int]) -> np.ndarray:
        """Poses (n, columns) of commands, some of which (numbers from 1) a person called unstable."""


class Drawing(Protocol):
    """What is drawn and kept of a drive."""

    measured_columns: tuple[str, ...]
    """Columns of its table of measurements."""

    def pose_columns(self, poses: np.ndarray) -> dict[str, np.ndarray]:
        """What is kept of poses, by name with its unit, (n,) each; x_m, y_m and heading_rad always."""

    def measurements(self, trial: int, commands: np.ndarray, poses: np.ndarray) -> pd.DataFrame:
        """The rows of the table of measurements for commands (n, components) and the poses (n, columns) they led to."""


class Options(Protocol):
    """What a robot's simulator can do beyond the dissertation, and other readings of it."""

    options: tuple[str, ...]
    """Switched on by ``ROBOT+OPTION`` as the robot's name in a spec."""
    switched_on: tuple[str, ...]
    """Those that are on."""
    substitute_sd_m: float | None
    """Standard deviation of the substitute world on every displacement, m, where it is not that of the static simulator."""

    def with_options(self, names: tuple[str, ...]) -> Robot:
        """The robot with some of its options, and no others, switched on."""


class Robot(
    Commands, CommandFiles, Evolution, Networks, Kinematics, Fitness, Stability, Drawing, Options, Protocol
):
    """All that is asked of a robot. Poses have columns of the robot's own; `pose_columns` names what is kept of them."""

    name: str
    physics: str
    """The module whose ``build(robot, model)`` makes its physics world; empty where it has none."""
    simulators: str
    """The package with the folder ``data`` in which its static simulator lies, NAME.safetensors."""
    two_wheeled: bool
    """Is it a `TwoWheeled`?"""


class TwoWheeled(Robot, Protocol):
    """A robot on two driven wheels."""

    world_model: str
    """The model that its physics world drives: a name, or the path of a YAML file."""

    def wheel_speeds_m_s(self, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Left and right speeds m/s and durations s, each (n,), of commands (n, components)."""


def rotate(points: np.ndarray, turn_rad: float) -> np.ndarray:
    """Points (n, 2) turned about the origin, counter-clockwise."""
    cos, sin = np.cos(turn_rad), np.sin(turn_rad)
    return points @ np.array([[cos, sin], [-sin, cos]])


def on_floor(robot: Robot, poses: np.ndarray) -> np.ndarray:
    """x_m, y_m, heading_rad (n, 3) of a robot's own poses (n, columns)."""
    columns = robot.pose_columns(poses)
    return np.column_stack([columns[name] for name in ("x_m", "y_m", "heading_rad")])
