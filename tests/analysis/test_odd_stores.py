"""Whatever is in the store, the figures are drawn or say why not: nothing fails, nothing is made up."""

from __future__ import annotations

import numpy as np
import pytest
from figure_helpers import with_evals, written
from store.synthetic import failed, make_store, record

from analysis import checks, findings, one_run, success_by_mutation, success_by_population, trials
from analysis.__main__ import figures, main
from analysis.coverage import coverage
from analysis.publish import captions
from analysis.results import NoDataError, Results
from analysis.selection import selections
from analysis.source import source, trials_of
from bns.spec import RunSpec
from bns.store import Writer, load

FULL = ("evals", "paths", "generations", "probes")
NO_RADII = {f"{prefix}success_{cm}cm": None for prefix in ("", "ever_", "evaluated_") for cm in (7, 10, 14, 20)}


def specs(seeds: int, **values) -> list[RunSpec]:
    return [RunSpec(seed=seed, evaluations=6, mutation_rate=rate, **values) for seed in range(seeds) for rate in (0.1, 0.5)]


STORES = {
    "one run": lambda path: written(path, "grid", [record(specs(1)[0])]),
    "one run with all": lambda path: written(path, "prototype", [record(RunSpec(evaluations=1, record="full"), FULL)]),
    "one combination": lambda path: written(path, "same", [record(RunSpec(seed=seed, evaluations=6)) for seed in range(8)]),
    "failures": lambda path: written(path, "bad", [failed(spec) for spec in specs(3)]),
    "never a success": lambda path: written(
        path, "grid", [with_evals(spec, success=False, success_7cm=False) for spec in specs(6)]
    ),
    "always a success": lambda path: written(path, "grid", [with_evals(spec, success=True) for spec in specs(6)]),
    "diversity unknown": lambda path: written(
        path, "grid", [with_evals(spec, diversity=np.nan, fitness_error=np.inf) for spec in specs(6)]
    ),
    "one task is ahead": lambda path: written(
        path, "grid", [record(spec) for spec in [*specs(6), *specs(1, task="infinity"), *specs(1, task="complex")]]
    ),
    "goal regions": lambda path: written(path, "grid", [with_evals(spec, **NO_RADII) for spec in specs(6)]),
}


@pytest.mark.parametrize("kind", STORES)
@pytest.mark.slow
def test_the_command_draws_or_explains_every_figure(tmp_path, kind, capsys):
    STORES[kind](tmp_path / "results")
    assert main(["--results", str(tmp_path / "results"), "--out", str(tmp_path / "out")]) == 0
    named = {caption["name"] for caption in captions(tmp_path / "out")}
    for name in figures():
        assert any(one == name or one.startswith(f"{name}-") for one in named), name
    assert capsys.readouterr().err == ""


@pytest.mark.slow
def test_a_script_that_fails_is_told_and_costs_no_other_figure(tmp_path, monkeypatch, capsys):
    written(tmp_path / "results", "grid", [record(spec) for spec in specs(6)])
    monkeypatch.setattr(findings, "draw", lambda store: 1 / 0)
    assert main(["--results", str(tmp_path / "results"), "--out", str(tmp_path / "out")]) == 1
    shown = {caption["name"]: caption for caption in captions(tmp_path / "out")}
    assert shown["findings"]["skipped"] == "its script failed: ZeroDivisionError: division by zero"
    assert "skipped" not in shown["success-by-mutation-khepera"]
    told = capsys.readouterr().err
    assert "ZeroDivisionError" in told
    assert "bns: findings (sections 4.6 and 5.9) could not be drawn; the others are" in told
    monkeypatch.undo()
    assert main(["--results", str(tmp_path / "results"), "--out", str(tmp_path / "out"), "--only", "findings"]) == 0
    assert [caption["name"] for caption in captions(tmp_path / "out") if "findings" in caption["name"]] == ["findings-khepera"]


def test_a_robot_without_goal_radii_has_its_own_success_and_no_centimetres(tmp_path):
    written(tmp_path, "grid", [with_evals(spec, **NO_RADII, success=spec.seed < 2) for spec in specs(6)])
    drawn = success_by_mutation.draw(Results(tmp_path))[0]
    assert drawn.data.query("evaluation == 6").successes.tolist() == [2, 2]
    assert "visits all goals, by mutation rate" in drawn.shows
    assert "cm" not in drawn.shows


def test_two_sweeps_that_compare_different_things_are_not_mixed(tmp_path):
    written(tmp_path, "rates", [record(spec) for spec in specs(5)])
    written(tmp_path, "sizes", [record(RunSpec(seed=s, evaluations=6, population_size=p)) for s in range(6) for p in (50, 99)])
    store = Results(tmp_path)
    assert success_by_mutation.draw(store)[0].sweeps == ("rates",)
    assert success_by_population.draw(store)[0].sweeps == ("sizes",)


def test_runs_of_an_older_engine_are_left_out_and_stated(tmp_path, monkeypatch):
    written(tmp_path, "grid", [record(spec) for spec in specs(6)])
    from bns import spec as module

    monkeypatch.setattr(module, "ENGINE_VERSION", module.ENGINE_VERSION - 1)
    written(tmp_path, "grid", [record(spec) for spec in specs(5)])
    monkeypatch.undo()
    assert len(load(tmp_path, "runs")) == 22
    drawn = success_by_mutation.draw(Results(tmp_path))[0]
    assert drawn.n == 12
    assert any("10 runs of circle" in text and "another world, engine" in text for text in drawn.missing)


def test_a_sweep_under_way_is_drawn_from_its_journal(tmp_path):
    with Writer(tmp_path, "grid") as writer:
        for spec in specs(5):
            writer.append(record(spec))
        assert list((tmp_path / "journal").glob("*.journal"))
        assert success_by_mutation.draw(Results(tmp_path))[0].n == 10


def test_one_run_shows_its_own_generations_and_probes(real_results):
    drawn = one_run.draw(Results(real_results))[0]
    run = load(real_results, "runs", where={"sweep": "prototype", "seed": 0})
    rows = load(real_results, "generations", where={"run_id": run.run_id[0]})
    lines = {line.get_label(): line.get_ydata() for line in drawn.figure.axes[0].get_lines()}
    assert lines["in simulation"] == pytest.approx(rows.best_fitness.round(4).to_numpy())  # as an archive keeps it
    assert lines["in the world"] == pytest.approx(rows.best_fitness_world.round(4).to_numpy())
    probes = load(real_results, "probes", where={"run_id": run.run_id[0]})
    assert drawn.figure.axes[1].get_lines()[-1].get_ydata() == pytest.approx(
        100 * probes.groupby("evaluation").distance_m.median().to_numpy(), abs=6e-4
    )  # of 0.01 mm
    assert [text.get_text() for text in drawn.figure.axes[1].get_legend().get_texts()] == ["each random controller", "median"]
    totals = 100 * probes.query("evaluation > 1").groupby("evaluation").change_m.sum()
    assert drawn.figure.axes[2].get_lines()[0].get_ydata() == pytest.approx(totals.to_numpy(), abs=6e-3)


def test_a_trial_says_when_it_succeeded_and_what_the_robot_would_have_cost(tmp_path):
    spec = RunSpec(evaluations=6, task="circle", record="full")
    success = np.array([False, True, False, True, True, True])
    run = with_evals(spec, success=success, success_10cm=np.ones(6, bool), driven_ms=30_000.0)
    written(tmp_path, "prototype", [run])
    drawn = trials.draw(Results(tmp_path))[0]
    row = drawn.data.iloc[0]
    assert (row.first_success, row.consistent, row.consistent_10cm, row.driving_min) == (2, 6, 3, 1.0)
    # The dissertation's robot took 30 s (task 1's second trial: 12 min for 20 evaluations is 36 s) to 50 s an evaluation.
    low, high = trials.seconds_an_evaluation("khepera")
    assert (low, high) == (pytest.approx(60 * 25 / 45), pytest.approx(50))
    assert drawn.table["consistent, 3 in succession"][0] == "6 (3 to 5 min)"
    assert drawn.table["the dissertation's trial"][0] == "45 (25 min)"


def test_every_finding_of_the_source_has_a_check_and_every_robot_its_trials():
    assert len(source()["findings"]) > 20
    for finding in source()["findings"]:
        assert callable(getattr(checks, finding["check"])), finding
        assert finding["check"] in source()["in_words"], finding
        for _, arguments in findings._each_task(finding):
            assert "{" not in findings._in_words(finding["check"], arguments)
    assert trials_of("khepera", 3) == [(55, 40), (60, 50), (45, 30)]
    assert trials_of("khepera", 9) == trials_of("unknown", 1) == []


def test_planted_findings_are_found_and_too_few_seeds_leave_everything_undecided(study, tmp_path):
    table = findings.draw(Results(study))[0].table.set_index(["where", "task"]).verdict
    assert table["section 4.6.1", "1, circle"] == "agrees"  # the mutation rate matters most
    assert table["figure 4.11", "1, circle"] == "agrees"  # the error rises with diversity
    make_store(tmp_path, 15, evaluations=6)  # one seed of each combination
    with pytest.raises(NoDataError, match="no combination has 5 finished runs"):
        selections_then_rank(tmp_path)
    few = findings.draw(Results(tmp_path))[0].table
    assert set(few.verdict) == {"undecided"}


def selections_then_rank(results):
    from analysis.ranking import ranking

    store = Results(results)
    return ranking(store, selections(store)[0])


def of_approaches(*names: str, **values) -> list:
    return [record(RunSpec(approach=name, seed=s, evaluations=6, mutation_rate=r, **values)) for name in names
            for s in range(5) for r in (0.1, 0.5)]  # fmt: skip


def test_the_approach_that_is_drawn_is_named_where_there_are_others_and_is_why_they_are_left_out(tmp_path):
    written(tmp_path, "grid", of_approaches("bns", "bns+margin=0.03", "on-robot"))
    drawn = success_by_mutation.draw(Results(tmp_path))[0]
    assert drawn.n == 10
    assert "n = 10 runs of grid (approach bns);" in drawn.shows
    assert drawn.missing == ("20 runs of circle with other approaches, bns+margin=0.03, on-robot, left out",)


def test_an_approach_is_not_the_only_reason_where_more_differs(tmp_path):
    written(tmp_path, "grid", [*of_approaches("bns", "on-robot"), *of_approaches("on-robot", world="physics")])
    missing = success_by_mutation.draw(Results(tmp_path))[0].missing
    assert "10 runs of circle with another approach, on-robot, left out" in missing
    assert any("or of another approach (on-robot), another world, engine or other bounds" in text for text in missing)


def test_an_approach_that_is_the_only_one_is_not_named(tmp_path):
    written(tmp_path, "grid", of_approaches("on-robot"))
    assert "n = 10 runs of grid;" in success_by_mutation.draw(Results(tmp_path))[0].shows


def test_each_task_names_its_own_approach(tmp_path):
    made = [*of_approaches("bns", "on-robot"), *of_approaches("on-robot", task="infinity")]
    written(tmp_path, "grid", made)
    assert "(approaches bns for circle, on-robot for infinity)" in success_by_mutation.draw(Results(tmp_path))[0].shows


def test_a_finished_sweep_of_which_a_part_is_drawn_is_not_under_way(tmp_path):
    text = """
name: grid
robot: khepera
seeds: 5
fixed: {evaluations: 6}
grid: {approach: [bns, on-robot], mutation_rate: [0.1, 0.5]}
"""
    written(tmp_path, "grid", of_approaches("bns", "on-robot"), sweep_text=text, sweep_runs=20)
    said = coverage(Results(tmp_path), ["grid"], 10)
    assert (said.amount, said.missing) == ("10 of 20 runs", ())
    assert coverage(Results(tmp_path), ["grid"], 20).amount == "20 runs"
