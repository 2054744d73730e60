"""Other readings of the source, switched on by the Khepera's name: each does what it says, and nothing else changes."""

import numpy as np
import pytest

from bns.bootstrap.trainer import Trainer, untrained
from bns.engine.philox import Key
from bns.errors import SpecError
from bns.robots import load_robot
from bns.robots.khepera.options import READINGS
from bns.spec import RunSpec
from bns.sweep.jobs.job import run_job
from bns.tasks import load_task

KEY, TASK, PLAIN = Key(4, 2), load_task("khepera", "circle"), load_robot("khepera")


def test_every_reading_can_be_named_and_all_together():
    for name in READINGS:
        assert load_robot(f"khepera+{name}").switched_on == (name,)
    assert load_robot("+".join(["khepera", *PLAIN.options])).switched_on == PLAIN.options
    assert PLAIN.switched_on == ()
    with pytest.raises(SpecError, match="exact-durations"):
        load_robot("khepera+exact-duration")


@pytest.mark.parametrize(("name", "penalty_m"), [("penalty-1m", 1), ("penalty-3m", 3), ("penalty-1m+penalty-3m", 1)])
def test_a_penalty_is_what_its_name_says_in_simulation_and_in_the_world(name, penalty_m):
    other, population = load_robot(f"khepera+{name}"), PLAIN.initial_population(KEY, 20, 4, 100)
    weights = untrained(PLAIN, KEY)
    ten, few = PLAIN.score(population, weights, TASK), other.score(population, weights, TASK)
    missed = len(TASK.goals_m) - ten.goals_reached
    np.testing.assert_allclose(1 / ten.fitness - 1 / few.fitness, (10 - penalty_m) * missed, rtol=1e-9)
    assert missed.max() > 0
    poses = np.array([[0.3, 0.3, 1.0], [0.5, 0.1, 2.0]])
    (fit, reached), (less, as_many) = (robot.evaluate_path(poses, TASK) for robot in (PLAIN, other))
    assert reached == as_many
    assert 1 / fit - 1 / less == pytest.approx((10 - penalty_m) * (len(TASK.goals_m) - reached))


def test_a_flat_spot_is_added_to_slopes_in_training():
    spec = RunSpec()
    rules = [Trainer.start(robot, KEY, spec).rule for robot in (PLAIN, load_robot("khepera+flat-spot"))]
    assert [rule.flat_spot for rule in rules] == [0.0, 0.1]


def test_runs_of_another_reading_have_other_names_and_numbers_under_the_same_luck():
    spec = {"evaluations": 4, "population_size": 20, "training_iterations_per_evaluation": 50, "generations_per_evaluation": 5}
    plain = run_job(RunSpec(**spec)).tables["evals"]
    for name in READINGS:
        other = RunSpec(robot=f"khepera+{name}", **spec)
        assert other.run_id != RunSpec(**spec).run_id
        rows = run_job(other).tables["evals"]
        # The first controller is picked from the same population; what is learned or bred from it differs.
        assert rows["driven_ms"][0] == plain["driven_ms"][0]
        assert rows["mean_fitness"].tolist() != plain["mean_fitness"].tolist(), name
