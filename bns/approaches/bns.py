"""Bootstrapped Neuro-Simulation (BNS): networks, population and drives from nothing, all at once.

After the dissertation, figure 3.1 and section 3.3: no data is collected before; what evolution finds promising is driven,
the networks learn from that, and the evolution goes on with them.
"""

from __future__ import annotations

from collections import deque
from typing import ClassVar, Self

import numpy as np

from bns.approaches.parts.base import Choice, Option, Options, Setting
from bns.approaches.parts.ensemble import USES, Ensemble, WorstSimulator
from bns.approaches.parts.hybrid import MODELS, NO_MODEL, Arcs, HybridSimulator, arcs_of
from bns.approaches.parts.informed import SNAPSHOTS, most_informative
from bns.approaches.parts.neuro_simulation import NeuroSimulation
from bns.approaches.parts.noisy import NoisySimulator, check_missed, check_noise, most_certain, residual_sd
from bns.approaches.parts.polishing import check_polish, polished
from bns.approaches.parts.shortening import shorten
from bns.approaches.parts.surprise import IN_A_ROW, Surprise
from bns.bootstrap.simulators import NetworkSimulator, Simulator
from bns.bootstrap.trainer import Learner, Trainer
from bns.engine.evolution import Population
from bns.errors import SpecError
from bns.tasks import Task

STEPS = 10
"""In so many steps goals narrow by the whole margin, and noise grows to its full size; widening 3 and 10 times as fast did no
better (five seeds, three tasks)."""


class BootstrappedNeuroSimulation(NeuroSimulation):
    """The four steps; driving is the loop's. All options go beyond the dissertation.

    ``margin``: algorithm 2 rewards touching the edge of a goal, and a small error of the networks then misses it. Goals
    that are narrower in evolution than on the robot leave room for such errors. They narrow by a tenth of the margin
    after each round whose fittest controller reaches all of them in simulation, and widen by as much after any other:
    goals that nobody reaches lead nowhere.

    ``noise``: each controller is simulated so many times under noise, up to as large as the networks' errors on what they did
    not learn from; its fitness is that of the mean, and the fittest is the one of the best tenth that succeeds most often
    (`bns.approaches.parts.noisy`). Noise grows and shrinks by tenths as the margin does: under all of it, no controller
    reaches anything on networks that have hardly learned.

    ``renew``: once the fittest controller has not reached all goals in simulation for so many rounds, all controllers give way
    to random ones; the networks stay. A population that converged on poor networks hardly gets away from there: on the way to a
    goal that is missing, each further command costs fitness until it is reached. Its successor starts on networks that know more.

    ``missed``: under noise, each goal missed costs so many metres more than the robot's own penalty, and a failure as much once
    more. By distances alone a single command that can be saved outweighs some success; now the surer path is the fitter one.

    ``shorten``: so large a share of all children loses commands (`bns.approaches.parts.shortening`).

    ``polish``: under noise, so many steps of a local search follow each round, from the surest controller on
    (`bns.approaches.parts.polishing`).

    ``ensemble``: so many networks for each displacement (`bns.approaches.parts.ensemble`). ``use``: evolution works on
    their mean, on the one that thinks worst of a controller, or on one of them, drawn for each round.

    ``informed``: step 1 takes, out of this share of the population, fittest first, the controller that networks disagree on
    most (`bns.approaches.parts.informed`): those of the ensemble, or those of the latest rounds.

    ``window``: networks learn from so many latest drives. ``restart``: they begin with untrained weights, and the latest drives
    alone, once their prediction errors exceed the usual ones by that factor (`bns.approaches.parts.surprise`).
    The population stays. Both are for robots that change.

    ``model``: a physics model predicts first, and the networks learn what it gets wrong (`bns.approaches.parts.hybrid`).
    """

    options: ClassVar[Options] = {
        "margin": Option(0.0, 0.0, 1.0, "m by which goals become narrower in evolution, all around"),
        "noise": Option(0, 0, 1000, "simulations of each controller under noise; 0: one without"),
        "renew": Option(0, 0, 1000, "rounds without a controller that reaches all goals until a new population; 0: never"),
        "missed": Option(0.0, 0.0, 1000.0, "m that each goal missed under noise, and failing, costs beyond the robot's penalty"),
        "shorten": Option(0.0, 0.0, 1.0, "fraction of each generation's children that lose commands"),
        "polish": Option(0, 0, 1000, "steps of a local search on the surest controller after each round, under noise; 0: none"),
        "ensemble": Option(1, 1, 100, "networks for each displacement"),
        "use": Choice("mean", USES, "what evolution works on where networks are several"),
        "informed": Option(0.0, 0.0, 1.0, "fraction of the population, fittest first, of which the most informative is driven"),
        "model": Choice(NO_MODEL, MODELS, "physics whose errors the networks learn", (".yaml", ".yml")),
        "window": Option(0, 0, 100_000, "latest drives that networks learn from; 0: all"),
        "restart": Option(0.0, 0.0, 1000.0, "multiple of the usual error from which a drive counts as a surprise; 0: never"),
    }

    def __init__(self, setting: Setting, trainer: Learner, arcs: Arcs | None = None) -> None:
        """Goals as wide as they are; arcs: the model whose errors the trainer learns."""
        self._arcs = arcs
        self._narrowed = self._rounds = self._in_vain = 0
        self._surprise = Surprise(setting.number("restart"))
        self._latest: deque[np.ndarray] = deque(maxlen=SNAPSHOTS)
        if setting.options["margin"]:
            self._check_margin(setting)
        if setting.options["noise"]:
            check_noise(setting)
        check_missed(setting)
        check_polish(setting)
        self._chosen: tuple[int, np.ndarray] | None = None
        self._polished: list[np.ndarray] = []
        super().__init__(setting, trainer)
        if setting.options["shorten"]:
            self.evolver.after_breeding = self._shorten

    @classmethod
    def start(cls, setting: Setting) -> Self:
        """Untrained networks, as many as the options say."""
        size, use, arcs = setting.whole("ensemble"), setting.chosen("use"), arcs_of(setting)
        if size == 1 and use != "mean":
            raise SpecError(f"approach bns+use={use}: there is one network; add networks, such as ensemble=3.")
        known = arcs.displacements if arcs else None
        if size > 1:
            return cls(setting, Ensemble.start(setting, size, known), arcs)
        return cls(setting, Trainer.start(setting.robot, setting.key, setting.spec, known), arcs)

    @staticmethod
    def _check_margin(setting: Setting) -> None:
        if not getattr(setting.robot, "narrows_goals", False):
            raise SpecError(
                f"approach bns+margin: robot {setting.robot.name} cannot narrow its goals; use bns without a margin."
            )
        _narrower(setting, setting.number("margin"))

    def pick(self, evaluation: int) -> np.ndarray:
        """Step 1: the winner of the real-world selection tournament, or what the committee disagrees on."""
        if share := self.setting.number("informed"):
            several, evolver = self.trainer, self.evolver
            committee = several.networks() if isinstance(several, Ensemble) else list(self._latest)
            found = most_informative(self.setting.robot, committee, evolver.population, evolver.order, share)
            if found is not None:
                return self.plan(evolver.population.controller(found))
        return self.plan(self.evolver.pick(evaluation))

    def learn(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Take what a drive measured into the training set, and older drives out if the options say so."""
        error = self._error(commands[: len(poses)], poses) if self.setting.options["restart"] else 0.0
        super().learn(commands, poses, evaluation)
        if window := self.setting.whole("window"):
            self.trainer.forget(window)
        if self.setting.options["restart"] and self._surprise.changed(error):
            self.trainer.forget(IN_A_ROW)
            self.trainer.restart()

    def _error(self, commands: np.ndarray, poses: np.ndarray) -> float:
        """Root of the mean square of what the simulator gets wrong of a drive, command by command, in units of targets."""
        robot = self.setting.robot
        said, seen = (robot.measured_displacements(path) for path in (self.simulator.poses(commands), poses))
        return float(np.sqrt(np.mean((robot.targets(said) - robot.targets(seen)) ** 2)))

    def advance(self) -> None:
        """Steps 2 and 3: train, copy the training networks over the evolution networks, evolve on those."""
        self._rounds += 1
        self.train()
        self.copy()
        self._latest.append(self.weights)
        if self._in_vain and self._in_vain == self.setting.whole("renew"):
            self._renew()
        self.evolve()
        if any(self.setting.options[name] for name in ("margin", "noise", "renew")):
            scores, best = self.evolver.scores, self.evolver.order[0]
            all_reached = scores.goals_reached[best] == len(self.setting.task.goals_m)
            self._narrowed = min(self._narrowed + 1, STEPS) if all_reached else max(self._narrowed - 1, 0)
            self._in_vain = 0 if all_reached else self._in_vain + 1
            if self.setting.options["polish"] and (all_reached or self._polished):
                self._polish()

    def simulator_now(self) -> Simulator:
        """The networks, or what ``use`` makes of several."""
        several, use = self.trainer, self.setting.chosen("use")
        if isinstance(several, Ensemble) and use == "worst":
            return WorstSimulator(tuple(map(self._on, several.networks())), self._on(self.weights))
        if isinstance(several, Ensemble) and use == "sampled":
            self.weights = several.drawn(self._rounds)
        return self._on(self.weights)

    def fittest(self) -> np.ndarray:
        """The best controller in simulation; under noise, the most certain one of the best."""
        evolver, simulator = self.evolver, self.simulator
        if not isinstance(simulator, NoisySimulator):
            return super().fittest()
        if self._chosen is None or self._chosen[0] != evolver.generations:
            self._chosen = evolver.generations, evolver.population.controller(self._surest(simulator))
        return self._chosen[1].copy()

    def _surest(self, simulator: NoisySimulator) -> int:
        evolver, key = self.evolver, self.setting.own_key("noise")
        return most_certain(simulator, evolver.population, evolver.order, self.setting.task, key, evolver.generations)

    def _polish(self) -> None:
        """A local search from the surest controller, of this round or of an earlier one; it takes the place of this round's."""
        setting, simulator, evolver = self.setting, self.simulator, self.evolver
        assert isinstance(simulator, NoisySimulator)
        with self.timed("evolution_cpu_s"):
            found = self._surest(simulator)
            known = [evolver.population.controller(found), *self._polished]
            self._polished = [polished(simulator, known, setting, evolver.generations)]
            evolver.put(found, self._polished[0], simulator)
        self._chosen = evolver.generations, self._polished[0]

    def _shorten(self, children: Population, generation: int) -> None:
        setting = self.setting
        shorten(children, setting.number("shorten"), setting.spec.min_commands, setting.own_key("shortening"), generation)

    def _renew(self) -> None:
        """Random controllers in the places of all; the evolution that follows scores them."""
        spec, key = self.setting.spec, self.setting.own_key(f"renewal {self._rounds}")
        others = self.setting.robot.initial_population(key, spec.population_size, spec.min_commands, spec.max_commands)
        self.evolver.replace(np.arange(spec.population_size), others)
        self._in_vain = 0

    def _on(self, weights: np.ndarray) -> Simulator:
        """These networks, after the model where there is one, and under noise where that is asked for."""
        networks = NetworkSimulator(self.setting.robot, self.goals(), weights)
        simulator = HybridSimulator(self._arcs.robot, self.goals(), self._arcs, networks) if self._arcs else networks
        if rows := self.setting.whole("noise"):
            sd = residual_sd(self.setting.robot, weights, self.trainer.data.validation)
            sd_now, missed_m = sd * self._narrowed / STEPS, self.setting.number("missed")
            return NoisySimulator(simulator, sd_now, rows, missed_m=missed_m)
        return simulator

    def goals(self) -> Task:
        """The task with goals as narrow as they now are in evolution."""
        return _narrower(self.setting, self.setting.number("margin") * self._narrowed / STEPS)


def _narrower(setting: Setting, margin_m: float) -> Task:
    radii_m = setting.robot.radii_m
    return setting.task.narrower(margin_m, radii_m[0] if radii_m else 0.0) if margin_m else setting.task


APPROACH = BootstrappedNeuroSimulation
