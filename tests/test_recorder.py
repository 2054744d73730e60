"""What a recorder remembers of a run."""

from types import SimpleNamespace

import numpy as np

from bns.bootstrap import recorder as recording
from bns.bootstrap.loop import run
from bns.engine.philox import Key
from bns.robots import load_robot
from bns.spec import RADII_CM, RunSpec
from bns.tasks import load_task
from bns.worlds import build_world

QUICK = {"population_size": 8, "generations_per_evaluation": 1, "training_iterations_per_evaluation": 2, "evaluations": 6}


def test_a_success_is_remembered_radius_by_radius(monkeypatch):
    """Success comes and goes; ever_success stays from the first time on, and is not there before it."""
    seen = [(0, 0, 0, 0), (0, 0, 0, 1), (0, 0, 1, 1), (0, 0, 0, 0), (0, 1, 1, 1), (0, 0, 0, 1)]
    ever = np.maximum.accumulate(np.array(seen), axis=0).astype(bool)
    robot, step = load_robot("khepera"), iter(range(100))
    of_fittest = recording.Recorder._successes

    def scripted(self, prefix, poses):
        real = of_fittest(self, prefix, poses)
        if prefix != "success":
            return real
        now = seen[next(step)]
        return {"success": bool(now[0])} | {f"success_{cm}cm": bool(n) for cm, n in zip(RADII_CM, now, strict=True)}

    monkeypatch.setattr(recording.Recorder, "_successes", scripted)
    rows = run(RunSpec(robot=robot.name, **QUICK)).tables["evals"]
    for column, cm in enumerate(RADII_CM):
        assert rows[f"ever_success_{cm}cm"].tolist() == ever[:, column].tolist()
    assert rows["ever_success"].tolist() == ever[:, 0].tolist()


def test_a_probe_changes_by_what_it_moved_since_the_evaluation_before():
    robot, spec = load_robot("khepera"), RunSpec(record="full", **QUICK)
    recorder = recording.Recorder(robot, load_task("khepera", "circle"), build_world(spec.world, robot), Key(0, 0), spec)
    for evaluation, x_m in enumerate((1.0, 1.5, 3.5), start=1):
        simulator = SimpleNamespace(poses=lambda commands, x_m=x_m: np.tile([x_m, 0.0, 0.0], (len(commands), 1)))
        recorder._add_probes(evaluation, recorder._probes, simulator)
    changes = recorder.tables()["probes"]["change_m"].reshape(3, recording.PROBES)
    assert np.isnan(changes[0]).all()
    np.testing.assert_allclose(changes[1:], [[0.5] * recording.PROBES, [2.0] * recording.PROBES])
