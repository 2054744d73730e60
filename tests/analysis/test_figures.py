from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from store.synthetic import failed, make_store, record

from analysis import budget, one_run, paths, scatter, success_by_diversity, success_by_mutation
from analysis.__main__ import figures
from analysis.intervals import POOLED, pooled, wilson
from analysis.results import NoDataError, Results
from analysis.scatter import LEGEND_PT
from analysis.selection import finished
from bns.errors import SweepWarning
from bns.plotting.style import COLUMN_IN, PAGE_IN, TEXT_PT
from bns.spec import RunSpec
from bns.store import Writer, load
from bns.store.archive.write import archive

ROUNDED = 5.1e-4
"""Figures take diversity and fitness to 0.001, as an archive keeps them."""


def written(results, sweep, records, **more):
    with Writer(results, sweep, **more) as writer:
        for one in records:
            writer.append(one)


def specs(seeds, **values):
    return [
        RunSpec(seed=seed, evaluations=4, mutation_rate=rate, **values) for seed in range(seeds) for rate in (0.1, 0.5)
    ]


def curves(figure):
    """Label -> (x, y) of the labelled lines of the first axes."""
    lines = figure.axes[0].get_lines()
    return {line.get_label(): line.get_data() for line in lines if not line.get_label().startswith("_")}


def drawn_or_nothing(module, store):
    try:
        return module.draw(store)
    except NoDataError:
        return []


def test_every_figure_is_drawn_from_a_real_store_legibly_and_says_how_many_runs(real_results, texts):
    store = Results(real_results)
    drawn = [one for module in figures().values() for one in drawn_or_nothing(module, store)]
    assert {one.name: one.n for one in drawn} == {
        "best-combinations-khepera-circle": 10,
        "best-combinations-khepera-complex": 10,
        "budget": 7,
        "diversity-of-extremes-khepera-circle": 10,
        "diversity-of-extremes-khepera-complex": 10,
        "findings-khepera": 20,
        "fitness-error-by-diversity-khepera": 20,
        "influence-khepera": 20,
        "one-run-khepera": 1,
        "paths-khepera-infinity": 2,
        "potential-success-khepera": 10,
        "success-by-diversity-khepera": 20,
        "success-so-far-by-mutation-khepera": 20,
        "success-by-mutation-khepera": 20,
        "success-so-far-khepera": 20,
        "trials-khepera": 2,
    }
    for one in drawn:
        assert f"n = {one.n}" in one.shows or one.n < 5, one.name
        if one.figure is None:
            assert one.table is not None
            continue
        assert one.figure.get_figwidth() in (COLUMN_IN, PAGE_IN)
        assert min(size for _, size in texts(one.figure)) >= TEXT_PT, one.name


def test_success_by_mutation_shows_what_pandas_counts(real_results):
    drawn = success_by_mutation.draw(Results(real_results))[0].figure
    rows = load(real_results, "evals", where={"sweep": "mutation", "task": "circle"})
    shares = rows.groupby(["mutation_rate", "evaluation"]).success_7cm.mean() * 100
    for rate, label in ((0.1, "10 % (n = 5)"), (0.5, "50 % (n = 5)")):
        x, y = curves(drawn)[label]
        assert list(x) == [1, 2, 3, 4, 5, 6]
        assert y == pytest.approx(shares[rate].to_numpy(float))
    assert [ax.get_title() for ax in drawn.axes if ax.get_title()] == ["(a) circle", "(b) complex"]


def test_the_bands_are_wilson_intervals_of_those_counts(tmp_path):
    make_store(tmp_path, 60, evaluations=3)
    figure = success_by_mutation.draw(Results(tmp_path))[0].figure
    rows = load(tmp_path, "evals").query("mutation_rate == 0.02")
    low, high = wilson(rows.groupby("evaluation").success.sum().to_numpy(int), [12] * 3)
    corners = figure.axes[0].collections[0].get_paths()[0].vertices[:, 1]
    assert {round(v, 6) for v in corners} == {round(v, 6) for v in [*(100 * low), *(100 * high)]}
    assert rows.success.sum() > 0


def test_success_by_diversity_shows_what_pandas_counts(real_results):
    figure = success_by_diversity.draw(Results(real_results))[0].figure
    rows = load(real_results, "evals", where={"sweep": "mutation", "task": "circle", "evaluation": 6})
    means = rows.groupby("mutation_rate").agg(x=("diversity", "mean"), y=("success_7cm", "mean"))
    for rate, label in ((0.1, "10 %"), (0.5, "50 %")):
        x, y = curves(figure)[label]
        assert (x[0], y[0]) == (pytest.approx(means.x[rate], abs=ROUNDED), pytest.approx(100 * float(means.y[rate])))
    titles = [ax.get_title() for ax in figure.axes]
    assert titles == [  # no task is easy after six evaluations, so each is shown at the next radius, too
        f"({letter}) {task}, within {cm} cm"
        for letter, (task, cm) in zip("abcd", [(t, cm) for t in ("circle", "complex") for cm in (7, 10)], strict=True)
    ]


def test_a_crowd_of_combinations_shows_means_of_groups_in_place_of_intervals(real_results, monkeypatch):
    few = success_by_diversity.draw(Results(real_results))[0]
    monkeypatch.setattr(scatter, "CROWD", 1)
    monkeypatch.setattr(scatter, "GROUPS", 1)
    frame = pd.DataFrame({"diversity": [1.0, 3.0, 2.0], "y": [0.0, 50.0, 40.0], "low": 0.0, "high": 100.0, "mutation_rate": 0.1})
    _figure, [ax] = scatter.scatter_figure([scatter.Panel("circle", frame)], "mutation_rate", "successful runs (%)")
    mean = next(line for line in ax.get_lines() if line.get_marker() == "None")
    assert (mean.get_xdata()[0], mean.get_ydata()[0]) == (2.0, 30.0)
    ends = ax.collections[0].get_paths()[0].vertices[:, 1]
    assert ends.max() - 30.0 == pytest.approx(4.303 * np.std([0, 50, 40], ddof=1) / np.sqrt(3), rel=1e-3)  # Student, 2 to spare
    many = success_by_diversity.draw(Results(real_results))[0]
    assert "bars" in few.shows
    assert "bars" not in many.shows
    assert "lines: means of 1 equal groups" in many.shows


def test_budget_shows_success_and_median_cost_of_each_cell_and_what_is_missing(real_results):
    drawn = budget.draw(Results(real_results))[0]
    runs = load(real_results, "runs", where={"sweep": "budget"})
    cost = runs.groupby(["training_iterations_per_evaluation", "generations_per_evaluation"]).cpu_s.median()
    lines = {line.get_label(): line.get_ydata() for line in drawn.figure.axes[2].get_lines()}
    for iterations in (10, 20):
        assert lines[str(iterations)] == pytest.approx(cost[iterations].to_numpy())
    assert drawn.missing == ("7 of 8 runs so far",)


def test_budget_counts_the_late_evaluations_of_each_run(tmp_path):
    runs = [record(RunSpec(seed=seed, evaluations=10), ("evals",)) for seed in range(3)]
    for run, late in zip(runs, (0, 1, 3), strict=True):
        run.tables["evals"]["success_7cm"][:] = [True] * 7 + [True] * late + [False] * (3 - late)
        run.tables["evals"]["success_10cm"][:] = True
    written(tmp_path, "budget", runs)
    cell = budget.cells(Results(tmp_path)).iloc[0]
    assert (cell.runs, cell.share_7, cell.share_10) == (3, pytest.approx(100 * 4 / 9), 100)
    assert cell.low_7 == 0 < cell.share_7 < cell.high_7 == 100  # Student: 44 ± 126


def test_paths_show_the_last_fittest_controller_of_each_run(real_results):
    figure = paths.draw(Results(real_results))[0].figure
    evals = load(real_results, "evals", where={"sweep": "prototype", "seed": 0})
    shown = evals[evals.success].evaluation.max() if evals.success.any() else 3
    rows = load(real_results, "paths", where={"run_id": evals.run_id[0], "evaluation": int(shown), "who": "fittest"})
    assert figure.axes[0].get_title().startswith(f"seed 0, evaluation {shown}:")
    x, y = curves(figure)["robot"]
    end = (100 * rows.x_m.iloc[-1], 100 * rows.y_m.iloc[-1])
    assert (x[-1], y[-1]) == pytest.approx(end, abs=0.006)  # poses are taken to 0.1 mm, as an archive keeps them


def test_a_drive_that_ended_early_says_in_which_cycle(tmp_path):
    run = record(RunSpec(seed=0, evaluations=2, record="full"), ("evals", "paths"))
    run.tables["evals"]["fittest_commands"][:] = 90
    written(tmp_path, "prototype", [run])
    store = Results(tmp_path)
    driven = len(paths.poses(store, paths.last_successes(store))[run.spec.run_id]) - 1
    assert paths.draw(store)[0].figure.axes[0].get_title().endswith(f"ended in cycle {driven} of 90")


def test_all_drives_of_a_trial_s_final_controller_are_drawn_with_their_mean(tmp_path):
    spec = RunSpec(seed=0, evaluations=2, record="full")
    run = record(spec, ("evals", "paths"))
    run.tables["evals"]["success"][:] = False
    written(tmp_path, "trials-emulated", [run])
    folder = tmp_path / "trials" / f"khepera-circle-0-{spec.run_id}-emulated"
    folder.mkdir(parents=True)
    drives = [
        {"evaluation": 2, "repeat": n, "success": n == 2, "step": step, "x_m": 0.1 * n * step, "y_m": 0.2 * step}
        for n, steps in ((1, 3), (2, 3), (3, 2))
        for step in range(steps)
    ]
    pd.DataFrame(drives).assign(heading_rad=1.5).to_csv(folder / "repeats.csv", index=False)
    drawn = paths.draw(Results(tmp_path))[0]
    lines = drawn.figure.axes[0].get_lines()
    ends = [line.get_xdata()[-1] for line in lines if line.get_label().endswith("each drive")]
    assert ends == pytest.approx([20, 40, 30])
    x, y = curves(drawn.figure)["robot, mean"]
    assert (x[-1], y[-1]) == (pytest.approx(20), pytest.approx(20))  # as far as all of them go
    assert drawn.figure.axes[0].get_title().endswith("all goals in 1 of 3 drives")
    assert drawn.data.repeat.value_counts().to_dict() == {1: 3, 2: 3, 3: 2}
    assert "each drive is thin" in drawn.shows


def test_paths_of_a_run_by_hand_are_shown_after_the_prototypes_and_named(tmp_path):
    both = RunSpec(seed=0, evaluations=2, record="full")
    others = [RunSpec(seed=seed, evaluations=2, record="full") for seed in range(1, 8)]
    tables = ("evals", "paths")
    written(tmp_path, "prototype", [record(both, tables)])
    written(tmp_path, "by-hand", [record(spec, tables) for spec in (both, *others)])
    written(tmp_path, "without", [record(RunSpec(seed=9, evaluations=2))])
    drawn = paths.draw(Results(tmp_path))[0]
    titles = [ax.get_title().split(", evaluation")[0] for ax in drawn.figure.axes]
    assert titles == ["prototype,\nseed 0", *(f"by-hand,\nseed {seed}" for seed in range(1, 6))]
    assert (drawn.n, drawn.sweeps) == (8, ("prototype", "by-hand"))
    assert "runs of prototype, by-hand had one" in drawn.shows
    assert "2 more runs of this task not shown" in drawn.missing


def test_sweeps_with_a_grid_of_mutation_rates_are_pooled_and_the_same_run_counts_once(tmp_path):
    written(tmp_path, "one", [record(spec) for spec in specs(3)])
    written(tmp_path, "two", [record(spec) for spec in specs(5)])  # the first three seeds again
    written(tmp_path, "single", [record(RunSpec(seed=9, evaluations=4, mutation_rate=0.1, population_size=50))])
    drawn = success_by_mutation.draw(Results(tmp_path))[0]
    assert set(curves(drawn.figure)) == {"10 % (n = 5)", "50 % (n = 5)"}
    assert (drawn.n, drawn.sweeps) == (10, ("one", "two"))
    assert "n = 10 runs of one, two" in drawn.shows


def test_curves_of_a_few_runs_are_left_out_beside_thicker_ones_and_stated(tmp_path):
    few = [spec for spec in specs(2, task="complex") if spec.mutation_rate == 0.1]
    written(tmp_path, "one", [record(spec) for spec in (*specs(5), *few)])
    drawn = success_by_mutation.draw(Results(tmp_path))[0]
    assert set(curves(drawn.figure)) == {"10 % (n = 5)", "50 % (n = 5)"}
    assert drawn.n == 10
    assert "2 runs in curves of fewer than 5 not drawn" in drawn.missing


def test_curves_of_a_tenth_of_the_runs_are_left_out_beside_thick_ones(tmp_path):
    few = [spec for spec in specs(6, task="complex") if spec.mutation_rate == 0.1]
    written(tmp_path, "one", [record(spec) for spec in (*specs(70), *few)])
    drawn = success_by_mutation.draw(Results(tmp_path))[0]
    assert set(curves(drawn.figure)) == {"10 % (n = 70)", "50 % (n = 70)"}
    assert "6 runs in curves of fewer than 7 not drawn" in drawn.missing


def test_runs_of_another_length_are_left_out_and_named(tmp_path):
    written(tmp_path, "one", [record(spec) for spec in specs(3)])
    written(tmp_path, "two", [record(spec) for spec in specs(2, generations_per_evaluation=7)])
    drawn = success_by_mutation.draw(Results(tmp_path))[0]
    assert drawn.n == 6
    assert any("4 runs of circle with 4 evaluations, 7 generations" in text for text in drawn.missing)


def test_runs_of_an_earlier_file_of_the_sweep_are_left_out_and_stated(tmp_path):
    text = "name: grid\nrobot: khepera\nseeds: {}\nfixed: {{evaluations: 4, task: circle}}\ngrid: {{mutation_rate: {}}}"
    of_today = [RunSpec(seed=0, evaluations=4, mutation_rate=rate, task="circle") for rate in (0.1, 0.9)]
    before = [record(spec) for spec in specs(3, task="circle")]
    written(tmp_path, "grid", before, sweep_text=text.format(3, [0.1, 0.5]), sweep_runs=6)
    assert success_by_mutation.draw(Results(tmp_path))[0].n == 6
    written(tmp_path, "grid", [record(of_today[1])], sweep_text=text.format(1, [0.1, 0.9]), sweep_runs=2)
    drawn = success_by_mutation.draw(Results(tmp_path))[0]
    assert set(curves(drawn.figure)) == {"10 % (n = 1)", "90 % (n = 1)"}
    assert drawn.missing == ("5 runs of an earlier file of the name grid left out",)
    archive(tmp_path, tmp_path / "kept.parquet")
    from_archive = success_by_mutation.draw(Results(tmp_path / "kept.parquet", archived=True))[0]
    assert (from_archive.n, from_archive.missing) == (2, drawn.missing)


def test_figures_of_single_runs_leave_out_an_earlier_file_of_the_sweep_too(tmp_path):
    text = "name: grid\nrobot: khepera\nseeds: 1\nfixed: {{evaluations: 4, task: circle, record: full, mutation_rate: {}}}"
    tables = ("evals", "paths", "generations", "probes")
    for rate in (0.1, 0.9):
        spec = RunSpec(seed=0, evaluations=4, mutation_rate=rate, task="circle", record="full")
        written(tmp_path, "grid", [record(spec, tables)], sweep_text=text.format(rate), sweep_runs=1)
    store = Results(tmp_path)
    (drawn,) = paths.draw(store)
    assert drawn.n == 1
    assert "1 run of an earlier file of the name grid left out" in drawn.missing
    assert paths.last_successes(store).mutation_rate.tolist() == [0.9]
    assert spec.run_id in one_run.draw(store)[0].shows
    earlier = RunSpec(seed=0, evaluations=4, mutation_rate=0.1, task="circle", record="full").run_id
    alone = Results(tmp_path, earlier)  # a run that is asked for by its name is drawn, whatever file it is of
    assert paths.draw(alone)[0].n == 1
    assert earlier in one_run.draw(alone)[0].shows


def test_files_that_add_to_a_confirmation_all_count(tmp_path):
    text = "name: grid-confirm\nrobot: khepera\nseeds: 1\nfixed: {{evaluations: 4, task: circle, mutation_rate: {}}}"
    for spec in specs(1, task="circle"):
        written(tmp_path, "grid-confirm", [record(spec)], sweep_text=text.format(spec.mutation_rate), sweep_runs=1)
    assert finished(Results(tmp_path), ["grid-confirm"]) == 2


def test_failed_and_planned_runs_are_stated_on_the_figure(tmp_path, texts):
    text = (
        "name: grid\nrobot: khepera\nseeds: 3\nfixed: {evaluations: 4, task: circle}\n"
        "grid: {mutation_rate: [0.1, 0.5, 0.9]}"
    )
    written(
        tmp_path, "grid", [*(record(spec) for spec in specs(1)), failed(specs(2)[2])], sweep_text=text, sweep_runs=9
    )
    drawn = success_by_mutation.draw(Results(tmp_path))[0]
    said = " ".join(text.replace("\n", " ") for text, _ in texts(drawn.figure))
    for part in ("2 of 9 runs so far", "1 of 3 combinations without a finished run", "1 failed run not shown"):
        assert part in said
        assert part in drawn.missing


def test_a_plan_of_an_older_version_with_a_value_twice_is_read(tmp_path):
    text = "name: grid\nrobot: khepera\nseeds: 3\nfixed: {evaluations: 4, task: circle}\ngrid: {mutation_rate: [0.1, 0.5, 0.1]}"
    written(tmp_path, "grid", [record(spec) for spec in specs(1)], sweep_text=text, sweep_runs=6)
    with pytest.warns(SweepWarning, match="mutation_rate: 0.1"):
        plan = Results(tmp_path).plans["grid"]
    assert (plan.runs, plan.cells, plan.varied) == (6, 2, {"mutation_rate"})


def test_what_two_sweeps_ask_for_is_planned_once(tmp_path):
    text = "name: {}\nrobot: khepera\nseeds: {}\nfixed: {{evaluations: 4, task: circle}}\ngrid: {{mutation_rate: {}}}"
    written(tmp_path, "all", [record(spec) for spec in specs(2)], sweep_text=text.format("all", 3, [0.1, 0.5, 0.9]), sweep_runs=9)
    written(tmp_path, "part", [record(spec) for spec in specs(2)], sweep_text=text.format("part", 4, [0.1, 0.5]), sweep_runs=8)
    assert "4 of 11 runs so far" in success_by_mutation.draw(Results(tmp_path))[0].missing


def test_one_run_of_a_planned_grid_is_drawn_with_its_wide_interval(tmp_path):
    text = "name: grid\nrobot: khepera\nfixed: {evaluations: 4, task: circle}\ngrid: {mutation_rate: [0.1, 0.5]}"
    written(tmp_path, "grid", [record(specs(1)[0])], sweep_text=text, sweep_runs=2)
    drawn = success_by_mutation.draw(Results(tmp_path))[0]
    assert set(curves(drawn.figure)) == {"10 % (n = 1)"}
    heights = np.ptp(drawn.figure.axes[0].collections[0].get_paths()[0].vertices[:, 1])
    assert heights > 75  # one run says next to nothing
    with pytest.raises(NoDataError, match=r"no combination has 2 finished runs yet \(the most is 1\)"):
        success_by_diversity.draw(Results(tmp_path))


@pytest.mark.parametrize(("runs", "enough"), [(3, True), (2, False)])
def test_all_combinations_with_three_runs_are_dots_rather_than_those_of_another_sweep_with_five(tmp_path, runs, enough):
    plan = "name: {}\nrobot: khepera\nseeds: {}\nfixed: {{evaluations: 4, task: circle}}\ngrid: {{mutation_rate: {}}}"
    rates, some = [0.1, 0.3, 0.5, 0.7, 0.9], [0.1, 0.5]
    of_all = [RunSpec(seed=seed, evaluations=4, mutation_rate=rate) for rate in rates for seed in range(runs)]
    of_some = [RunSpec(seed=seed, evaluations=4, mutation_rate=rate) for rate in some for seed in range(6)]
    written(tmp_path, "all", [record(spec) for spec in of_all], sweep_text=plan.format("all", 30, rates), sweep_runs=150)
    written(tmp_path, "some", [record(spec) for spec in of_some], sweep_text=plan.format("some", 6, some), sweep_runs=12)
    drawn = success_by_diversity.draw(Results(tmp_path))[0]
    assert len(curves(drawn.figure)) == (5 if enough else 2)
    assert any("runs left out" in text for text in drawn.missing) is not enough


def test_only_combinations_with_enough_runs_are_dots_and_the_others_are_counted(tmp_path):
    few = [RunSpec(seed=seed, evaluations=4, mutation_rate=0.9) for seed in range(2)]
    written(tmp_path, "grid", [record(spec) for spec in [*specs(6), *few]])
    drawn = success_by_diversity.draw(Results(tmp_path))[0]
    assert set(curves(drawn.figure)) == {"10 %", "50 %"}
    assert drawn.n == 12
    assert "1 combination with fewer than 5 runs left out" in drawn.missing


@pytest.mark.parametrize(("name", "module"), figures().items())
def test_a_store_of_one_combination_or_of_failures_alone_says_what_would_feed_a_figure(tmp_path, name, module):
    written(tmp_path / "same", "same", [record(RunSpec(seed=seed, evaluations=4)) for seed in range(6)])
    written(tmp_path / "bad", "bad", [failed(spec) for spec in specs(2)])
    for folder in ("same", "bad"):
        with pytest.raises(NoDataError, match=r"run (make sweep|bns sweep|bns validate)"):
            module.draw(Results(tmp_path / folder))


@pytest.mark.parametrize("module", [success_by_mutation, success_by_diversity])
def test_why_there_is_nothing_to_compare_is_said(tmp_path, module):
    one, single = RunSpec(seed=0, evaluations=4), RunSpec(seed=1, evaluations=4)
    written(tmp_path / "bad", "bad", [failed(spec) for spec in (one, single)])  # one rate, so no comparison either
    with pytest.raises(NoDataError, match=r"^2 runs failed and none finished; run bns sweep khepera-small"):
        module.draw(Results(tmp_path / "bad"))
    written(tmp_path / "one", "one", [record(one)])
    with pytest.raises(NoDataError, match=r"^no sweep compares .* \(1 finished run\); run bns sweep"):
        module.draw(Results(tmp_path / "one"))
    written(tmp_path / "one", "more", [failed(single)])
    with pytest.raises(NoDataError, match=r"\(1 finished run, 1 failed\); run bns sweep"):
        module.draw(Results(tmp_path / "one"))


def test_captions_say_what_the_intervals_take_for_granted(real_results, texts):
    store = Results(real_results)
    drawn = success_by_diversity.draw(store)[0]
    assert "pointwise; runs taken as independent, though combinations share their seeds" in drawn.shows
    assert any("pointwise 95 % Wilson intervals" in text.replace("\n", " ") for text, _ in texts(drawn.figure))
    drawn = success_by_mutation.draw(store)[0]
    assert POOLED in drawn.shows
    assert any(POOLED in text.replace("\n", " ") for text, _ in texts(drawn.figure))


def test_a_band_of_pooled_runs_knows_that_they_share_the_luck_of_their_seeds():
    """Of ten seeds, five succeed in all twelve combinations, five in none: ten draws, and not a hundred and twenty."""
    seeds = pd.DataFrame({"seed": np.arange(10), "root_seed": 0})
    rows = pd.concat([seeds.assign(task="circle", evaluation=at, runs=12, successes=12 * (seeds.seed < many))
                      for at, many in ((1, 5), (2, 10), (3, 0))])  # fmt: skip
    found = pooled(rows, ("task",)).set_index("evaluation")
    assert list(found.runs) == [120] * 3
    luck = np.random.default_rng(5).binomial(10, 0.5, 100_000) / 10
    assert (found.low[1], found.high[1]) == pytest.approx(tuple(np.quantile(luck, (0.025, 0.975))), abs=0.05)
    for at, many in ((2, 120), (3, 0)):
        assert (found.low[at], found.high[at]) == pytest.approx(wilson(many, 120))
    few = pooled(rows[rows.seed < 4], ("task",)).set_index("evaluation")
    assert (few.low[1], few.high[1]) == pytest.approx(wilson(48, 48))
    one_more = rows[(rows.seed < 6) & (rows.evaluation == 1)]
    halves = pooled(pd.concat([one_more.assign(task="infinity"), rows]), ("task",))
    assert len(halves) == 4
    assert halves[halves.task == "circle"].low.to_numpy() == pytest.approx(found.low.to_numpy())


def test_markers_of_a_legend_are_large_enough_however_many_dots_there_are(study):
    (drawn, *_) = success_by_diversity.draw(Results(study))
    assert {handle.get_markersize() for handle in drawn.figure.legends[0].legend_handles} == {LEGEND_PT}


def test_paths_say_of_which_combination_each_is_where_these_differ(tmp_path):
    written(tmp_path, "one", [record(spec, ("evals", "paths")) for spec in specs(1)])
    titles = [axis.get_title() for axis in paths.draw(Results(tmp_path))[0].figure.axes]
    assert [title.partition(",")[0] for title in titles if title] == ["mutation rate 10 %", "mutation rate 50 %"]
