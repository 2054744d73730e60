"""Figures and findings from an archive are those from the results, digit for digit; what it cannot carry says so."""

from __future__ import annotations

import pytest

from analysis.__main__ import figures, main
from analysis.publish import DIGITS, _origins
from analysis.results import NoDataError, Results
from bns.store.archive.write import archive

OF_RUNS = {"budget"}
"""Scripts that the small store has data for and that need more of a run than an archive keeps."""


def _said(drawn):
    return drawn.data.to_csv(float_format=DIGITS)


def told(store):
    """By script: what its figures say, numbers as text; or why there is none."""
    made = {}
    for name, module in figures().items():
        try:
            made[name] = [
                (one.name, one.shows, one.see, one.n, one.missing, _said(one), _origins(store, one.sweeps))
                for one in module.draw(store)
            ]
        except NoDataError as reason:
            made[name] = str(reason)
    return made


@pytest.mark.slow
@pytest.mark.parametrize("which", ["study", "real_results"])
def test_every_figure_and_finding_is_the_same_from_the_archive(which, request, tmp_path):
    results = request.getfixturevalue(which)
    path = archive(results, tmp_path / "study.parquet").path
    runs, archived = told(Results(results)), told(Results(path, archived=True))
    other = {name for name in runs if runs[name] != archived[name] and isinstance(runs[name], list)}
    assert other <= OF_RUNS
    assert {len(runs[name]) > 0 for name in ("success-by-mutation", "findings", "influence", "diversity-of-extremes")} == {True}
    for name in other:
        assert "carry out the sweep and draw it from the runs" in archived[name], name
    assert bool(other) == (which == "real_results")


def test_the_command_draws_from_the_published_archive(study, tmp_path, capsys):
    archive(study, tmp_path / "published" / "study.parquet")
    assert main(["--results", str(tmp_path), "--from", "published", "--only", "findings"]) == 0
    assert (tmp_path / "figures" / "findings-khepera.csv").is_file()
    assert main(["--results", str(tmp_path), "--from", str(tmp_path / "none.parquet")]) == 2
    assert "there is no archive at" in capsys.readouterr().err


@pytest.mark.slow
def test_a_missing_table_or_column_is_named(real_results, tmp_path):
    path = archive(real_results, tmp_path / "study.parquet").path
    store = Results(path, archived=True)
    with pytest.raises(NoDataError, match=r"left_units.*carry out the sweep and draw it from the runs"):
        store.query("SELECT left_units FROM paths")
    with pytest.raises(NoDataError, match="training_error"):
        store.query("SELECT training_error FROM evals")
    with pytest.raises(NoDataError, match=r"\(column cpu_s\)"):  # which DuckDB says in other words
        store.query("SELECT any_value(cpu_s) AS cpu_s FROM evals JOIN runs USING (run_id, sweep)")
    with pytest.raises(NoDataError, match=r"\(table hours\)"):
        store.query("SELECT * FROM hours")
