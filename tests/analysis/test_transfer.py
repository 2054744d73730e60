"""Controllers taken to another world, and back to their own."""

import numpy as np
import pandas as pd
import pytest

from analysis.results import NoDataError, Results
from analysis.transfer.__main__ import main
from analysis.transfer.drives import SUCCESSES, described, first_success, summary, transferred
from analysis.transfer.figure import transfer_figure
from bns.bootstrap.loop import run
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.store.record import RunRecord
from bns.store.write.writer import Writer
from bns.worlds import build_world

ROBOT = load_robot("khepera")
SMALL = {"population_size": 20, "training_iterations_per_evaluation": 20, "generations_per_evaluation": 2, "evaluations": 3}
ROW = {
    "status": "ok",
    "error": None,
    "started_at": pd.Timestamp.now("UTC").to_pydatetime(),
    "wall_s": 1.0,
    "cpu_s": 1.0,
    "peak_memory_mib": 1.0,
    "attempts": 1,
}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    for sweep, record, seeds in (("with", "paths", 2), ("without", "evals", 2), ("more", "paths", 1)):
        with Writer(folder, sweep) as writer:
            for seed in range(seeds):
                spec = RunSpec(world="physics", seed=seed, record=record, **SMALL)
                result = run(spec)
                writer.append(RunRecord(spec, ROW | {"world_digest": result.world_digest}, result.tables))
    return folder


ROUNDED = 5.1e-4
"""Figures take diversity and fitness to 0.001, as an archive keeps them."""


def test_a_sweep_taken_to_its_own_world_gives_its_own_numbers(results):
    store = Results(results)
    drives = transferred(store, ["with"], build_world("physics", ROBOT), ROBOT)
    own = store.query("SELECT * FROM evals WHERE sweep = 'with' ORDER BY seed, evaluation")
    for name in ("seed", "evaluation", "fitness_world", "fitness_error", *SUCCESSES):
        np.testing.assert_allclose(
            drives[name].astype(float), own[name].astype(float), rtol=0.0, atol=ROUNDED, err_msg=name
        )


def test_another_world_gives_others(results):
    store = Results(results)
    own, other = (transferred(store, ["with"], build_world(world, ROBOT), ROBOT) for world in ("physics", "substitute"))
    assert (own.fitness_simulation == other.fitness_simulation).all()
    assert (own.fitness_world != other.fitness_world).any()


def test_sweeps_without_paths_are_refused(results):
    with pytest.raises(NoDataError, match="The sweep without has no runs of khepera with paths"):
        transferred(Results(results), ["without"], build_world("physics", ROBOT), ROBOT)


def drives(first):
    """Runs of four evaluations that succeed from ``first`` on (5: never), fitness error 0.1 times the seed."""
    rows = [
        {"sweep": "s", "task": "circle", "seed": seed, "evaluation": e, "fitness_error": 0.1 * seed}
        | dict.fromkeys(SUCCESSES, e >= begin)
        for seed, begin in enumerate(first)
        for e in range(1, 5)
    ]
    return pd.DataFrame(rows)


def test_the_summary_counts_what_was_planted():
    table = summary(drives([1, 2, 2, 3, 5, 5]))
    row = table.iloc[0]
    assert (row.runs, row.never, row.evaluations_needed) == (6, 2, 3)
    assert row.success_7cm == pytest.approx(4 / 6)
    assert row.success_7cm_low < 4 / 6 < row.success_7cm_high
    assert row.fitness_error == pytest.approx(0.25)
    assert row.evaluations_needed_low <= 3
    assert np.isinf(row.evaluations_needed_high)
    assert list(first_success(drives([1, 5]))) == [1, np.inf]
    assert "| circle | mine | 6 | 67% (" in described(table, {"s": "mine"})


def test_the_command_writes_tables_and_a_figure(results, tmp_path, capsys):
    where = ["--to", "physics", "--results", str(results), "--out", str(tmp_path / "out")]
    assert main(["with=mine", "--reference", "more=beside", *where]) == 0
    said = capsys.readouterr().out
    assert "| mine | 2 |" in said
    assert "| beside | 1 |" in said
    drives = pd.read_csv(tmp_path / "out" / "transfer.csv")
    assert len(drives) == 3 * SMALL["evaluations"]
    assert (tmp_path / "out" / "transfer.png").is_file()


def test_references_are_thin_and_have_no_band(tmp_path, monkeypatch):
    figures = []
    monkeypatch.setattr("analysis.transfer.figure.save", lambda figure, stem: (figures.append(figure), stem))
    both = pd.concat([drives([1, 2, 5]), drives([1, 1]).assign(sweep="r")], ignore_index=True)
    transfer_figure(both, {"s": "mine"}, {"r": "beside"}, tmp_path / "f")
    for ax in figures[0].axes:
        thick, thin = ax.get_lines()
        assert thick.get_linewidth() > thin.get_linewidth()
        assert len(ax.collections) == 1
    assert figures[0].axes[0].get_lines()[0].get_ydata() == pytest.approx([(4 + 3 + 0) / 12])  # the mean of one block


def test_a_sweep_that_is_missing_is_one_line_and_exit_2(results, tmp_path, capsys):
    assert main(["nothing", "--to", "physics", "--results", str(results), "--out", str(tmp_path)]) == 2
    assert "The sweep nothing has no runs of khepera with paths" in capsys.readouterr().err
    assert not any(tmp_path.iterdir())
