"""An archive gives back what it keeps of the results, to the last digit that it promises, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from bns.cli.main import main
from bns.errors import StoreError
from bns.spec import RunSpec
from bns.store import Writer, connect
from bns.store.archive.kept import (
    COMPARED,
    COMPARED_RUN,
    DECIMALS,
    EVAL_COLUMNS,
    RECORDED,
    RECORDED_ORDER,
    RECORDED_ROWS,
    RUN_COLUMNS,
    rounded_evals,
    rounded_rows,
)
from bns.store.archive.read import archives, connect_archives, described, recorded, recorded_tables
from bns.store.archive.write import archive
from bns.sweep.expand.grid import parse_sweep
from bns.sweep.runner import run_sweep
from store.synthetic import failed, record, records, specs

TEXT = "name: grid\nrobot: khepera\nseeds: 2\ngrid: {mutation_rate: [0.1, 0.5]}\n"


@pytest.fixture
def results(tmp_path):
    """Five runs of one sweep, one of them with a diversity that is no number, one failed; one run of a snake."""
    snake = record(RunSpec(robot="snake", task="two-regions", evaluations=4))
    for name in snake.tables["evals"]:
        if name.endswith("cm"):
            snake.tables["evals"][name] = np.full(4, None)
    odd = record(next(specs(1, evaluations=5, task="complex")))
    odd.tables["evals"]["diversity"][:2] = np.nan, np.inf
    with Writer(tmp_path / "results", "grid", sweep_text=TEXT, sweep_runs=4) as writer:
        for one in (*records(3, evaluations=3), odd, failed(RunSpec(seed=77))):
            writer.append(one)
    with Writer(tmp_path / "results", "regions") as writer:
        writer.append(snake)
    return tmp_path / "results"


def of(connection, table, columns, order):
    return connection.sql(f"SELECT {', '.join(columns)} FROM {table} ORDER BY {order}").to_arrow_table().to_pandas()


def test_an_archive_gives_back_runs_evaluations_and_sweep_files(results, tmp_path):
    made = archive(results, tmp_path / "study.parquet")
    assert (made.runs, made.sweeps) == (6, {"grid": 5, "regions": 1})
    assert str(made).startswith("6 runs (grid 5, regions 1)")
    there, back = connect(results), connect_archives([made.path])
    for columns, table, order in (
        (RUN_COLUMNS, "runs", "run_id"),
        (("sweep", "spec_hash", "written_at", "text", "runs"), "specs", "sweep"),
    ):
        pd.testing.assert_frame_equal(of(there, table, columns, order), of(back, table, columns, order), check_dtype=False)
    rows = of(back, "evals", EVAL_COLUMNS, "run_id, evaluation")
    plain = of(there, f"({rounded_evals('evals')})", EVAL_COLUMNS, "run_id, evaluation")
    pd.testing.assert_frame_equal(rows, plain, check_dtype=False, check_exact=True)
    exact = of(there, "evals", EVAL_COLUMNS, "run_id, evaluation")
    for name, decimals in DECIMALS.items():
        known = np.isfinite(exact[name])
        assert np.abs(rows[name] - exact[name])[known].max() <= 0.5 * 10**-decimals + 1e-12
        assert rows[name][~known].isna().all()
    assert (~np.isfinite(exact.diversity)).sum() == 2
    assert rows[rows.robot == "snake"].success_7cm.isna().all()
    assert rows[rows.robot == "khepera"].ever_success_20cm.notna().all()


def test_an_archive_says_where_it_comes_from_and_is_the_same_each_time(results, tmp_path):
    first, second = (archive(results, tmp_path / f"{name}.parquet", ["grid"]) for name in "ab")
    assert first.path.read_bytes() == second.path.read_bytes()
    said = described(first.path)
    assert (said["runs"], said["engine_versions"], len(said["spec_hashes"])) == (5, [3], 1)
    assert said["specs"][0]["text"] == TEXT
    assert said["world_digest"] == ["", "w0"]


def test_a_run_of_several_archives_counts_once_and_a_good_one_before_a_broken_one(results, tmp_path):
    folder = tmp_path / "published"
    archive(results, folder / "a.parquet")
    with Writer(results, "grid") as writer:
        writer.append(record(RunSpec(seed=77)))
    archive(results, folder / "b.parquet", ["grid"])
    back = connect_archives(archives(folder))
    assert back.execute("SELECT count(*), count(*) FILTER (status = 'ok') FROM runs").fetchall() == [(6, 6)]


def test_what_is_no_archive_is_refused_in_words(results, tmp_path):
    with pytest.raises(StoreError, match=r"must be a file that ends in \.parquet"):
        archive(results, tmp_path / "study.csv")
    with pytest.raises(StoreError, match=r"grdi.*grid, regions"):
        archive(results, tmp_path / "study.parquet", ["grdi"])
    with pytest.raises(StoreError, match="there is no archive at"):
        archives(tmp_path / "none")
    whole = archive(results, tmp_path / "study.parquet").path
    changed = bytearray(whole.read_bytes())
    changed[len(changed) // 3] ^= 1
    (tmp_path / "changed.parquet").write_bytes(changed)
    (tmp_path / "text.parquet").write_text("not a table")
    (tmp_path / "text.csv").write_text("a,b\n1,2\n")
    part = next((results / "journal").glob("*"), None)
    assert part is not None
    with pytest.raises(StoreError, match="is not as it was written"):
        connect_archives([tmp_path / "changed.parquet"])
    with pytest.raises(StoreError, match=r"is no archive\. Make one from the results: bns archive results -o text\.parquet"):
        connect_archives([tmp_path / "text.parquet"])
    with pytest.raises(StoreError, match=r"text\.csv is no archive\. .*: bns archive results -o text\.parquet"):
        connect_archives([tmp_path / "text.csv"])


def test_the_command_writes_the_file_or_says_why_not(results, tmp_path, capsys):
    assert main(["archive", str(results), "-o", str(tmp_path / "s.parquet"), "--sweep", "regions"]) == 0
    assert "1 runs (regions 1)" in capsys.readouterr().out
    assert main(["archive", str(tmp_path / "nowhere"), "-o", str(tmp_path / "t.parquet")]) == 2
    assert "there are no results in" in capsys.readouterr().err
    assert not (tmp_path / "t.parquet").exists()


def test_runs_of_an_archive_beside_the_results_count_as_done_and_are_kept(tmp_path):
    """A study goes on where its results are no longer: with its archive alone."""
    text = "name: tiny\nrobot: khepera\nseeds: 2\nfixed: {evaluations: 1, generations_per_evaluation: 1, population_size: 50}\n"
    sweep, first, second = tmp_path / "tiny.yaml", tmp_path / "first", tmp_path / "second"
    sweep.write_text(text)
    assert main(["sweep", str(sweep), "--results", str(first), "--jobs", "1"]) == 0
    whole = archive(first, tmp_path / "whole.parquet")
    run_sweep(parse_sweep(text, sweep), tmp_path / "half", limit=1)
    archive(tmp_path / "half", second / "archived" / "half.parquet")
    assert main(["sweep", str(sweep), "--results", str(second), "--jobs", "1"]) == 0
    runs = connect(second).execute("SELECT seed FROM runs").fetchall()
    assert len(runs) == 1
    joined = archive(second, tmp_path / "joined.parquet")
    assert joined.runs == whole.runs == 2
    assert described(joined.path)["spec_hashes"] == described(whole.path)["spec_hashes"]


def test_runs_of_the_results_count_beside_those_of_their_archives_and_before_them(tmp_path):
    results, runs = tmp_path / "results", [record(RunSpec(seed=seed, evaluations=4)) for seed in (1, 2, 3)]
    broken = failed(RunSpec(seed=3, evaluations=4))
    former = archive_of(tmp_path / "there", "grid", [runs[0], broken], tmp_path)
    (results / "archived").mkdir(parents=True)
    former.rename(results / "archived" / "former.parquet")
    assert recorded(results, "grid") == {runs[0].spec.run_id: "ok", broken.spec.run_id: "failed"}
    archive_of(results, "grid", runs[1:], tmp_path)
    assert recorded(results, "grid") == {run.spec.run_id: "ok" for run in runs}


@pytest.mark.parametrize("well", ["in the archive", "in the results"])
def test_of_a_run_that_failed_once_the_next_archive_keeps_what_went_well(tmp_path, well):
    results, spec = tmp_path / "results", RunSpec(seed=3, evaluations=4)
    older, newer = (record(spec), failed(spec)) if well == "in the archive" else (failed(spec), record(spec))
    former = archive_of(tmp_path / "there", "grid", [older], tmp_path)
    (results / "archived").mkdir(parents=True)
    former.rename(results / "archived" / "former.parquet")
    with connect_archives([archive_of(results, "grid", [newer], tmp_path)]) as back:
        assert back.execute("SELECT status, count(evaluation) FROM runs JOIN evals USING (run_id) GROUP BY ALL").fetchall() == [
            ("ok", 4)
        ]


def test_of_a_run_that_went_well_twice_the_next_archive_keeps_that_of_the_results(tmp_path):
    results, once = tmp_path / "results", record(RunSpec(seed=3, evaluations=4))
    former = archive_of(tmp_path / "there", "grid", [once], tmp_path)
    (results / "archived").mkdir(parents=True)
    former.rename(results / "archived" / "former.parquet")
    again = replace(once, run={**once.run, "world_digest": "w9"})
    assert described(archive_of(results, "grid", [again], tmp_path))["world_digest"] == ["w9"]


def test_sweeps_of_several_approaches_keep_what_they_are_compared_by(tmp_path):
    results, comparing = tmp_path / "results", [RunSpec(approach=name, evaluations=4) for name in ("bns", "on-robot")]
    plain = archive_of(results, "grid", records(3, evaluations=3), tmp_path)
    assert not {*COMPARED, *COMPARED_RUN} & set(pq.read_schema(plain).names)
    both = archive_of(results, "approaches", [record(spec) for spec in comparing], tmp_path)
    with connect(results) as there, connect_archives([both, plain]) as back:
        columns = ("run_id", "evaluation", *COMPARED)
        kept = of(back, "evals WHERE sweep = 'approaches'", columns, "run_id, evaluation")
        exact = of(there, f"({rounded_evals('evals')}) WHERE sweep = 'approaches'", columns, "run_id, evaluation")
        pd.testing.assert_frame_equal(kept, exact, check_dtype=False, check_exact=True)
        assert of(back, "evals WHERE sweep = 'grid'", COMPARED, "run_id").isna().all(axis=None)
        assert len(of(back, "evals WHERE sweep = 'grid'", ("run_id",), "run_id")) == 9
        cpu = dict(back.sql("SELECT sweep, any_value(cpu_s) FROM runs GROUP BY sweep").fetchall())
        assert cpu == {"approaches": 1.25, "grid": None}


def test_approaches_that_lie_in_an_archive_and_in_the_results_are_compared_together(tmp_path):
    results, (one, other) = tmp_path / "results", [RunSpec(approach=name, evaluations=4) for name in ("bns", "on-robot")]
    third = RunSpec(approach="precomputed", evaluations=4)
    former = archive_of(tmp_path / "there", "approaches", [record(one), record(third)], tmp_path)
    (results / "archived").mkdir(parents=True)
    former.rename(results / "archived" / "former.parquet")
    path = archive_of(results, "approaches", [record(other)], tmp_path)
    with connect_archives([path]) as back:
        assert not of(back, "evals", ("robot_s", "approach"), "approach").isna().any(axis=None)
        assert back.sql("SELECT count(DISTINCT approach) FROM runs WHERE cpu_s = 1.25").fetchall() == [(3,)]


def full(seed):
    """A run that recorded generations and probes; what the first probes changed by is not known."""
    made = record(RunSpec(seed=seed, evaluations=4, record="full"), ("evals", *RECORDED))
    made.tables["probes"]["change_m"][: len(made.tables["probes"]["change_m"]) // 4] = np.nan
    return made


def test_generations_and_probes_come_back_in_their_order_and_rounded(tmp_path):
    results = tmp_path / "results"
    path = archive_of(results, "prototype", [full(0), *records(2, evaluations=3), full(1)], tmp_path)
    with connect(results) as there, connect_archives([path]) as back:
        for table, decimals in RECORDED.items():
            columns = ("run_id", "sweep", *decimals)
            order = f"run_id, {RECORDED_ORDER[table]}"
            rows = f"{table} WHERE {RECORDED_ROWS[table]}"
            kept, plain = of(back, table, columns, order), of(there, f"({rounded_rows(rows, table)})", columns, order)
            pd.testing.assert_frame_equal(kept, plain, check_dtype=False, check_exact=True)
            assert kept.run_id.nunique() == 2
            for name, places in decimals.items():
                exact = of(there, rows, columns, order)[name]
                if name == "who":
                    continue
                assert np.nanmax(np.abs(kept[name] - exact)) <= 0.5 * 10**-places + 1e-12, name
        driven = [of(one, "evals WHERE sweep = 'prototype'", ("driven_ms",), "run_id, evaluation") for one in (there, back)]
        assert (driven[0].round() == driven[1]).all(axis=None)
        assert len(of(back, "runs WHERE started_at IS NOT NULL", ("run_id",), "run_id")) == 4
        assert back.sql("SELECT DISTINCT who FROM paths").fetchall() == [("fittest",)]
        assert back.sql("SELECT count(*) FILTER (change_m IS NULL) * 4 = count(*) FROM probes").fetchall() == [(True,)]


def test_runs_of_an_older_archive_that_recorded_more_keep_it_beside_new_ones(tmp_path):
    """And an archive of runs that recorded nothing more has no empty tables, as those of earlier versions."""
    results, former = tmp_path / "results", archive_of(tmp_path / "there", "prototype", [full(0)], tmp_path)
    (results / "archived").mkdir(parents=True)
    former.rename(results / "archived" / "former.parquet")
    path = archive_of(results, "grid", records(2, evaluations=3), tmp_path)
    plain = archive(results, tmp_path / "plain.parquet", ["grid"]).path
    with connect_archives([path]) as back, connect_archives([plain]) as none, connect_archives([path, plain]) as both:
        assert back.sql("SELECT DISTINCT run_id FROM probes").fetchall() == [(full(0).spec.run_id,)]
        assert (recorded_tables(back), recorded_tables(none)) == ([*RECORDED], [])
        assert both.sql("SELECT count(*) FROM generations").fetchall() == back.sql("SELECT count(*) FROM generations").fetchall()


def archive_of(results, sweep, runs, folder):
    with Writer(results, sweep) as writer:
        for one in runs:
            writer.append(one)
    return archive(results, folder / f"{sweep}.parquet").path


def test_a_sweep_that_lies_in_an_archive_alone_stays_in_the_next(tmp_path):
    former = archive_of(tmp_path / "there", "grid", records(3, evaluations=3), tmp_path)
    (tmp_path / "results" / "archived").mkdir(parents=True)
    former.rename(tmp_path / "results" / "archived" / "former.parquet")
    with Writer(tmp_path / "results", "other") as writer:
        writer.append(record(RunSpec(evaluations=4)))
    made = archive(tmp_path / "results", tmp_path / "both.parquet")
    assert made.sweeps == {"grid": 3, "other": 1}
    assert archive(tmp_path / "results", tmp_path / "one.parquet", ["grid"]).sweeps == {"grid": 3}
    with pytest.raises(StoreError, match=r"unknown sweep in .* 'gird'\. Did you mean 'grid'"):
        archive(tmp_path / "results", tmp_path / "none.parquet", ["gird"])


@pytest.mark.filterwarnings("ignore:.*gone, though")
@pytest.mark.parametrize("sweeps", [["first"], None])
def test_runs_whose_evaluations_are_gone_are_left_out_of_an_archive_and_no_archive_is_empty(tmp_path, sweeps):
    results, path = tmp_path / "results", tmp_path / "a.parquet"
    for sweep, seed in (("first", 1), ("second", 2)):
        archive_of(results, sweep, [record(RunSpec(seed=seed, evaluations=4))], tmp_path)
    assert archive(results, path, sweeps).left_out == 0
    whole = path.read_bytes()
    for part in sorted((results / "evals").rglob("*.parquet")):
        if "first" in str(part):
            part.unlink()
    if sweeps:
        with pytest.raises(StoreError, match=r"no finished run in .* to archive: 1 run left out"):
            archive(results, path, sweeps)
        assert path.read_bytes() == whole
    else:
        made = archive(results, path)
        assert (made.runs, made.left_out) == (1, 1)
        assert "1 run left out, whose evaluations are damaged or gone" in str(made)
        with connect_archives([path]) as back:
            assert back.execute("SELECT seed FROM runs").fetchall() == [(2,)]


@pytest.mark.filterwarnings("ignore:.*gone, though")
def test_of_an_archive_runs_without_their_evaluations_do_not_count(tmp_path, monkeypatch):
    """As archives of an earlier release may have them."""
    monkeypatch.setattr("bns.store.archive.write.FINISHED", "SELECT sweep, run_id FROM runs")
    monkeypatch.setattr("bns.store.read.views.DAMAGED", "ok")
    results = tmp_path / "results"
    archive_of(results, "grid", records(2, evaluations=3), tmp_path)
    for part in (results / "evals").rglob("*.parquet"):
        part.unlink()
    archive(results, tmp_path / "archived" / "bad.parquet")
    assert recorded(tmp_path, "grid") == {}
    with connect_archives([tmp_path / "archived" / "bad.parquet"]) as back:
        assert back.execute("SELECT count(*) FROM runs").fetchall() == [(0,)]
