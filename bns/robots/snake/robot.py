"""What the loop asks of the snake."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bns.engine.evolution import Population, diversity
from bns.engine.philox import Key, Purpose, normals
from bns.engine.snn import predict
from bns.errors import SpecError
from bns.robots.base import RandomStream, Scores, StagedTraining, rotate
from bns.robots.snake import cycles, path, posture, table
from bns.robots.snake.options import BEYOND, READINGS, Options
from bns.robots.snake.rollout import evaluate, lanes_of, needed
from bns.robots.snake.rules import (
    BOUNDS,
    HALF,
    JOINT_SPEED_RAD_S,
    MIDDLE,
    MOST_REPEATS,
    NOISE_SD_M,
    NOISY_EVALUATIONS,
    REACH_M,
    REPEATS,
    SETTLE_S,
    STEP_RAD,
    SUBSTITUTE_SD_M,
)
from bns.tasks import Task

if TYPE_CHECKING:  # half a second to load, and a run needs no table
    import pandas as pd

_NO_CHANGES = np.empty((5, 0))


class Snake:
    """Implements `bns.robots.base.Robot`: poses are observations (n, 9) as in `path.walk`.

    What the dissertation leaves out can be switched on: ``changes`` (between cycles the markers move as `posture` says) and
    ``rigid`` (the markers, which are on one body, cannot drift apart); and other readings of it (`bns.robots.snake.options`).
    """

    name = "snake"
    options = tuple(sorted(BEYOND + READINGS))
    physics = "bns.physics.snake_drive"
    simulators = "bns.robots"
    two_wheeled = False
    marks_unstable = True
    narrows_goals = True
    networks = ("dx_yellow", "dy_yellow", "dx_green", "dy_green", "stable")
    hidden = 100
    input_count = 4
    sigmoid_output = True
    repeats_inputs = True
    recipe: StagedTraining | None = StagedTraining(400, 20, 3, 20, 4, 12_000, (*[SUBSTITUTE_SD_M] * 4, 0.0), ("crossover-80",))
    """Section 5.4.1; crossover there is 80/20 (section 5.4.2)."""
    radii_m: tuple[float, ...] = ()
    bounds = BOUNDS
    command_columns = cycles.COLUMNS
    measured_columns = table.COLUMNS
    given_columns: Mapping[str, tuple[float, float]] = {
        name: (float(low), float(high)) for name, low, high in zip(table.GAIT, bounds.low, bounds.high, strict=False)
    }

    def __init__(self, switched_on: tuple[str, ...] = ()) -> None:
        self.switched_on, self._options = switched_on, Options(switched_on)
        self.with_changes, self.rigid = "changes" in switched_on, "rigid" in switched_on
        self.parent_share = self._options.parent_share
        self.nguyen_widrow, self.flat_spot = "nguyen-widrow" in switched_on, self._options.flat_spot
        self.start_m, self.substitute_sd_m = self._options.start_m, self._options.noise_sd_m

    def with_options(self, names: tuple[str, ...]) -> Snake:
        """The snake with some of `options` switched on."""
        return Snake(names)

    def initial_population(self, key: Key, size: int, shortest: int, capacity: int) -> Population:
        """Random cycles, as many as ``capacity`` allows up to ten; all controllers have the same number."""
        return self._random(key, Purpose.INITIAL_COMMAND, size, min(cycles.CYCLES, capacity))

    def random_controllers(self, key: Key, count: int, length: int) -> Population:
        """Controllers of `length` random cycles, apart from every population's draws."""
        return self._random(key, Purpose.PROBE, count, length)

    def _random(self, key: Key, purpose: Purpose, count: int, length: int) -> Population:
        return cycles.random_cycles(key, purpose, 0, count, length, "sorted-amplitudes" in self._options)

    def perturb(self, commands: np.ndarray, key: Key, step: int) -> np.ndarray:
        """Cycles (n, 5), each component moved within its mutation span."""
        return cycles.perturb(commands, key, step)

    def inputs(self, commands: np.ndarray) -> np.ndarray:
        """Inputs (5, n): A_lat, A_vert, ω, α, each from -1 to 1, and one that is not used."""
        X = np.zeros((5, len(commands)), np.float32)
        X[:4] = ((commands - MIDDLE) / HALF)[:, :4].T
        return X

    def displacements(self, outputs: np.ndarray) -> np.ndarray:
        """(n, 5): to the right and along, m, of yellow, then of green; last the stability, from 0 to 1."""
        moved = np.array(outputs.T, np.float64)
        moved[:, :4] = (moved[:, :4] - 0.5) * REACH_M
        return moved

    def targets(self, displacements: np.ndarray) -> np.ndarray:
        """Network targets (5, n)."""
        wanted = np.array(displacements, np.float64)
        wanted[:, :4] = wanted[:, :4] / REACH_M + 0.5
        return np.ascontiguousarray(wanted.T, np.float32)

    def learnable(self, displacements: np.ndarray) -> np.ndarray:
        """Displacements are learned from stable cycles, stability from all (section 5.4.1)."""
        stable = displacements[:, 4] >= path.LEAST_STABLE
        return np.vstack([np.tile(stable, (4, 1)), np.ones((1, len(stable)), bool)])

    def poses(self, displacements: np.ndarray, commands: np.ndarray | None = None) -> np.ndarray:
        """Observations (n, 9) from the start of every task, every repeat a row; changes are asked of the commands."""
        return path.walk(displacements, self.changes(commands) if self.with_changes else None, self.rigid, self.start_m)

    def changes(self, commands: np.ndarray | None) -> np.ndarray:
        """What the change into each of these cycles (n, 5) does, (n, 5) as of `posture.changes`."""
        if commands is None:
            raise ValueError("a snake with changes needs the cycles that displacements belong to")
        return posture.changes(commands)

    def measured_displacements(self, poses: np.ndarray) -> np.ndarray:
        """What each cycle did between its own begin and end; what the change between cycles did is left out."""
        return path.unwalk(poses)

    def start_pose(self) -> np.ndarray:
        """Observation (1, 9) of a robot that has not moved yet."""
        markers = np.ravel(self.start_m)
        return np.concatenate([markers, markers, [1.0]])[None]

    def pose_columns(self, poses: np.ndarray) -> dict[str, np.ndarray]:
        """Middle and direction of the markers, then the markers, m and rad; whether the cycle was stable."""
        middle, line = path.middles(poses), poses[:, 6:8] - poses[:, 4:6]
        named = {"x_m": middle[:, 0], "y_m": middle[:, 1], "heading_rad": np.arctan2(line[:, 1], line[:, 0])}
        markers = ("yellow_x_m", "yellow_y_m", "green_x_m", "green_y_m")
        return named | dict(zip(markers, poses[:, 4:8].T, strict=True)) | {"stable": poses[:, path.STABLE] >= 0.5}

    def transform(self, poses: np.ndarray, turn_rad: float, shift_m: np.ndarray) -> np.ndarray:
        """Observations (n, 9) whose markers are turned about the origin, then shifted."""
        markers = rotate(poses[:, : path.STABLE].reshape(-1, 2), turn_rad) + shift_m
        return np.column_stack([markers.reshape(len(poses), path.STABLE), poses[:, path.STABLE]])

    def marked_unstable(self, poses: np.ndarray, commands: Sequence[int]) -> np.ndarray:
        """Observations (n, 9) of which those of these cycles (numbers from 1) were not stable."""
        marked = poses.copy()
        marked[[number - 1 for number in commands], path.STABLE] = 0.0
        return marked

    def plan(
        self, controller: np.ndarray, weights: np.ndarray | None, task: Task, stream: RandomStream | None = None
    ) -> np.ndarray:
        """Cycles that are driven, every repeat a row: only those that simulation needs to finish the task (section 5.3.2).

        With a stream these are as many as any of the noisy evaluations that decide on its fitness needed (figure 5.18); those
        that did not finish do not count; where none did, all are driven.
        """
        in_full = cycles.in_full(controller)
        if weights is None:
            return in_full
        moved = self.displacements(predict(weights, self.inputs(in_full), self.sigmoid_output))
        noise = self._noise(None if "cut-without-noise" in self._options else stream, len(in_full))
        return in_full[: self._needed(moved, in_full, task, noise) or len(in_full)]

    def _needed(self, moved: np.ndarray, in_full: np.ndarray, task: Task, noise: np.ndarray) -> int:
        """Cycles until simulated paths finish the task, the most of all rows of noise that do; 0 where none does."""
        changes = np.ascontiguousarray(self.changes(in_full).T) if self.with_changes else _NO_CHANGES
        path_of = self.start_m, np.ascontiguousarray(moved.T), changes, self.rigid
        return int(needed(*path_of, lanes_of(noise), len(noise), task.goals_m, task.region_m / 2))

    def score(
        self, population: Population, weights: np.ndarray, task: Task, stream: RandomStream | None = None,
        parents: Scores | None = None,
    ) -> Scores:
        """Mean fitness over ten noisy evaluations, all controllers under the same noise; without a stream there is none."""
        outputs = self._outputs(population, weights, None if parents is None else parents.outputs)
        return self.walk(population, self.displacements(outputs), task, stream)._replace(outputs=outputs)

    def _outputs(self, population: Population, weights: np.ndarray, known: np.ndarray | None) -> np.ndarray:
        """Outputs (networks, cycles) for all cycles; only those that are not known of the parents' generation are computed."""
        cycles_in_all, source = population.commands.reshape(-1, population.commands.shape[2]), population.origin.ravel()
        if known is None:
            return predict(weights, self.inputs(cycles_in_all), self.sigmoid_output)
        new = np.flatnonzero((source < 0) | (source >= known.shape[1]))
        outputs = known.take(source, axis=1, mode="clip")
        outputs[:, new] = predict(weights, self.inputs(cycles_in_all[new]), self.sigmoid_output)
        return outputs

    def walk(
        self, population: Population, displacements: np.ndarray, task: Task, stream: RandomStream | None = None
    ) -> Scores:
        """As `score`, from displacements (cycles, 5)."""
        commands = population.commands
        n, length, _ = commands.shape
        moves = np.ascontiguousarray(displacements.T)
        fitness, reached, used = np.empty(n), np.empty(n, np.int32), np.empty(n, np.int32)
        half = (task.region_m / 2, task.surface_m[0] / 2, task.surface_m[1] / 2)
        noise = self._noise(stream, length * MOST_REPEATS)
        lanes = lanes_of(noise), len(noise)
        repeats = np.ascontiguousarray(commands[..., REPEATS])
        moved = self._population_changes(commands)
        found = fitness, reached, used
        failures = evaluate(self.start_m, moves, moved, self.rigid, repeats, *lanes, task.goals_m, *half, *found)
        return Scores(fitness, reached, int(failures), used)

    def _population_changes(self, commands: np.ndarray) -> np.ndarray:
        """Changes into all cycles of a population (n, cycles, 5), (5, n * cycles); (5, 0) where they are ignored."""
        if not self.with_changes:
            return _NO_CHANGES
        n, length, _ = commands.shape
        before = np.arange(-1, n * length - 1)
        before[::length] = -1
        return np.ascontiguousarray(posture.changes(commands.reshape(n * length, -1), before).T)

    @staticmethod
    def _noise(stream: RandomStream | None, steps: int) -> np.ndarray:
        if stream is None:
            return np.empty((0, steps, 4))
        return normals(stream.key, Purpose.ROLLOUT_NOISE, stream.step, NOISY_EVALUATIONS, steps) * NOISE_SD_M

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
        """Uniform crossover and mutation; the number of cycles does not change, so none is cut."""
        cycles.breed(key, parents.commands, order, cdf, self.parent_share, rate, generation, children)
        children.lengths[:] = parents.lengths
        return 0

    def diversity(self, population: Population, scores: Scores) -> float:
        """Equation 4.1 over the cycles that each controller needs to finish the task in simulation (section 5.9.2)."""
        used = population.lengths if scores.used is None else scores.used
        return diversity(Population(population.commands, used), self.bounds)

    def evaluate_path(self, poses: np.ndarray, task: Task) -> tuple[float, int]:
        """Algorithm 3: fitness per metre, goals reached."""
        return path.evaluate_path(poses, task, self.start_m)[:2]

    def succeeded(self, poses: np.ndarray, task: Task) -> bool:
        """Whether all regions are reached in order."""
        return path.evaluate_path(poses, task, self.start_m)[1] == len(task.goals_m)

    def successes(self, poses: np.ndarray, task: Task) -> tuple[bool, ...]:
        """Empty: regions have no radius."""
        return ()

    def parse_commands(self, rows: np.ndarray) -> np.ndarray:
        """A cycle a row, driven once; SpecError where one would lift the body higher than it bends."""
        if ((rows[:, 1] >= rows[:, 0]) & rows[:, :2].any(axis=1)).any():  # both 0: it lies still
            raise SpecError("a cycle's a_vert_rad must be below its a_lat_rad: a body that lifts higher than it bends tips over")
        return np.column_stack([rows, np.ones(len(rows))]).astype(np.float32)

    def driven_ms(self, commands: np.ndarray) -> float:
        """Time of the cycles: twelve steps of the joint with the longest way at the constant speed, and the pauses."""
        largest_step = STEP_RAD * commands[:, 0]
        return float(1000 * 12 * (largest_step / JOINT_SPEED_RAD_S + SETTLE_S).sum())

    def measurements(self, trial: int, commands: np.ndarray, poses: np.ndarray) -> pd.DataFrame:
        """Two rows a cycle: its parameters and the markers at its begin, the markers and its stability at its end."""
        lasted_s = np.array([self.driven_ms(one[None]) / 1000 for one in commands.astype(np.float64)])
        return table.cycle_table(trial, commands, poses, lasted_s, SETTLE_S)
