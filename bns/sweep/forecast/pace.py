"""What a run costs on this machine, measured on one short run and carried over to runs with other parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bns.spec import RunSpec
from bns.store.record import RunRecord


@dataclass(frozen=True)
class Pace:
    """Seconds of the parts of a run, and how fast its training data grow.

    Training an evaluation's networks costs ``iteration_s`` an iteration, and ``pattern_s`` more for each pattern there is;
    ``patterns`` come with an evaluation. Evolution costs ``controller_s`` a controller and generation, ``evaluation_s`` is
    what an evaluation takes besides.
    """

    iteration_s: float
    pattern_s: float
    patterns: float
    controller_s: float
    evaluation_s: float

    @classmethod
    def of(cls, record: RunRecord) -> Pace:
        """From a run that went well. Its processor time is stretched to the time on the clock: others may use the machine."""
        spec, evals = record.spec, record.tables["evals"]
        stretch = max(1.0, record.run["wall_s"] / record.run["cpu_s"]) if record.run["cpu_s"] > 0 else 1.0
        iteration_s, pattern_s = _line(
            evals["training_patterns"],
            stretch * evals["training_cpu_s"] / max(1, spec.training_iterations_per_evaluation),
        )
        evolved_s = stretch * float(np.sum(evals["evolution_cpu_s"]))
        trained_s = stretch * float(np.sum(evals["training_cpu_s"]))
        return cls(
            iteration_s,
            pattern_s,
            float(evals["training_patterns"][-1]) / spec.evaluations,
            evolved_s / (spec.evaluations * _controllers(spec)),
            max(0.0, record.run["wall_s"] - trained_s - evolved_s) / spec.evaluations,
        )

    def seconds(self, spec: RunSpec) -> float:
        """Wall time of a run on one worker."""
        n = spec.evaluations
        patterns = self.patterns * n * (n + 1) / 2  # summed over the evaluations
        training = spec.training_iterations_per_evaluation * (n * self.iteration_s + patterns * self.pattern_s)
        return training + n * (_controllers(spec) * self.controller_s + self.evaluation_s)


def _controllers(spec: RunSpec) -> int:
    """Rollouts of an evaluation: each generation's, and one of the old population on the new networks."""
    return spec.population_size * (spec.generations_per_evaluation + 1)


def _line(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Height at 0 and slope, neither negative, of the line through (x, y) that is nearest on the whole."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    spread = float(((x - x.mean()) ** 2).sum())
    slope = float(((x - x.mean()) * (y - y.mean())).sum()) / spread if spread > 0 else 0.0
    slope = min(max(0.0, slope), float(y.mean() / x.mean()) if x.mean() > 0 else 0.0)
    return float(y.mean() - slope * x.mean()), slope
