"""What a recorder remembers of a run."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from bns.bootstrap import recorder as recording
from bns.bootstrap.driver import WorldDriver
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


def test_a_probe_is_off_by_the_distance_between_the_ends_of_its_paths():
    robot, spec = load_robot("khepera"), RunSpec(record="full", **QUICK)
    there = np.column_stack([np.arange(5.0), np.zeros((5, 2))])
    world = SimpleNamespace(repeatable=True, drive=lambda *_: there)
    recorder = recording.Recorder(robot, load_task("khepera", "circle"), world, Key(0, 0), spec)
    off = there.copy()
    off[-1] += [0.3, -0.4, 1.0]
    recorder._add_probes(1, recorder._probes, SimpleNamespace(poses=lambda _: off))
    np.testing.assert_allclose(recorder.tables()["probes"]["distance_m"], 0.5)


class Interrupted(WorldDriver):
    """Somebody ends each drive after its second command."""

    def drive(self, evaluation, controller, advance):
        whole = super().drive(evaluation, controller, advance)
        self.durations_ms = [*getattr(self, "durations_ms", []), whole.commands[:2, 2].sum()]
        return replace(whole, poses=whole.poses[:2])


def test_a_drive_that_ends_early_costs_what_was_driven_of_it():
    spec = RunSpec(overhead_s=7, **QUICK)
    robot = load_robot(spec.robot)
    driver = Interrupted(build_world(spec.world, robot), Key(0, 0))
    rows = run(spec, driver=driver).tables["evals"]
    assert (rows["commands"] == 2).all()
    np.testing.assert_allclose(rows["driven_ms"], driver.durations_ms)
    np.testing.assert_allclose(rows["robot_s"], np.cumsum(np.array(driver.durations_ms) / 1000 + 7))


class AskedWorld:
    """A world that notes under which purpose and step each drive draws its luck."""

    def __init__(self, spec):
        self._world = build_world(spec.world, load_robot(spec.robot))
        self.digest, self.repeatable, self.renderable = self._world.digest, True, False
        self.asked = []

    def drive(self, commands, key, purpose, step):
        self.asked.append((purpose.name, step))
        return self._world.drive(commands, key, purpose, step)


def test_no_two_drives_of_a_run_share_their_luck():
    spec = RunSpec(record="full", **QUICK | {"generations_per_evaluation": 2})
    world = AskedWorld(spec)
    run(spec, world=world)
    assert len(set(world.asked)) == len(world.asked)
    steps = {"WORLD_EVALUATED": 6, "WORLD_FITTEST": 6, "WORLD_GENERATION": 12, "PROBE": recording.PROBES}
    assert set(world.asked) == {(purpose, step) for purpose, last in steps.items() for step in range(1, last + 1)}
