"""The page of what replicates, and the paired readings that stand on it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from figure_helpers import with_evals, written
from store.synthetic import record

from analysis import margins, readings
from analysis.replication import page
from analysis.replication.__main__ import _gpus, main
from analysis.replication.numbers import studies
from analysis.results import NoDataError, Results
from bns.spec import RunSpec
from bns.store.archive.read import described
from bns.store.archive.write import archive
from bns.tasks import load_task

ROOT = Path(__file__).parents[2]
EVALUATIONS = 30


def paired(place, seeds, gain):
    """Default runs whose lists have 10 + seed commands, and runs with exact durations that have ``gain`` more."""
    for sweep, robot, more in (("readings", "khepera", 0), ("readings-exact-durations", "khepera+exact-durations", gain)):
        runs = []
        for seed in range(seeds):
            spec = RunSpec(robot=robot, seed=seed, evaluations=EVALUATIONS, population_size=100)
            near = dict.fromkeys((f"success_{cm}cm" for cm in (7, 10, 14, 20)), np.arange(EVALUATIONS) % 2 == 0)
            runs.append(with_evals(spec, fittest_commands=10 + seed + more, diversity=1.0 + 0.1 * more, **near))
        written(place, sweep, runs)
    return Results(place)


def test_readings_are_compared_on_the_same_seeds_with_an_interval_from_five_pairs_on(tmp_path):
    pairs, rows = readings.compared(paired(tmp_path, 6, 4))
    row = rows.iloc[0]
    assert (len(pairs), row.n, row.option, row.commands_default, row.commands) == (6, 6, "exact-durations", 12.5, 16.5)
    assert (row.commands_low, row.commands_high) == (4, 4)  # every pair differs by four, however long its lists
    assert (row.late_7cm, row.late_7cm_low, row.late_7cm_high) == (pytest.approx(400 / 9), 0, 0)
    said = readings.in_words(row.to_dict())
    assert said["commands of the fittest, late"] == "12 → 16 (+4 to +4)"
    assert said["reading"] == "`exact-durations`"


def test_few_pairs_have_no_interval_and_none_are_named(tmp_path):
    _, rows = readings.compared(paired(tmp_path / "few", 4, 4))
    assert np.isnan(rows.commands_low[0])
    written(tmp_path / "alone", "readings", [with_evals(RunSpec(seed=1, evaluations=4))])
    with pytest.raises(NoDataError, match="no run of a reading has a counterpart of the default reading"):
        readings.compared(Results(tmp_path / "alone"))


def test_a_goal_is_passed_where_it_counts_as_reached_and_in_order():
    task = load_task("khepera", "circle")
    first, second = task.goals_m[0], task.goals_m[1]
    path = np.array([second, first, second, second]) + np.array([[0, 0], [0.06, 0], [0, 0.2], [0.01, 0]])
    assert margins.passing(path, task, 0.07) == pytest.approx([0.06, 0.01])


def test_a_drive_without_noise_is_the_static_simulators_and_under_noise_fails_more_at_an_edge(tmp_path):
    specs = [RunSpec(seed=seed, evaluations=3, record="paths") for seed in range(5)]
    written(tmp_path, "readings", [record(spec, ("evals", "paths")) for spec in specs])
    rows = margins.margins(Results(tmp_path))
    assert len(rows) == 5
    assert set(rows.quiet) <= {0.0, 1.0}
    table = margins.summary(rows.assign(goal_1=0.065, goal_2=0.01, simulated=True))
    assert (table.first_goals_cm[0], table.last_goal_cm[0], table.simulated[0], table.runs[0]) == (6.5, 1.0, 100, 5)
    with pytest.raises(NoDataError, match="no run of the sweep margin has paths"):
        margins.margins(Results(tmp_path), "margin")
    narrow = [RunSpec(seed=seed, evaluations=3, record="paths", approach="bns+margin=0.03") for seed in range(2)]
    written(tmp_path, "margin", [record(spec, ("evals", "paths")) for spec in [*narrow, specs[0]]])
    assert margins.main(["--results", str(tmp_path), "--sweep", "margin", "--out", str(tmp_path / "m.csv")]) == 0
    assert pd.read_csv(tmp_path / "m.csv")[["approach", "runs"]].to_numpy().tolist() == [["bns", 1], ["bns+margin=0.03", 2]]


@pytest.mark.slow
def test_the_page_has_every_finding_with_its_verdict_and_the_same_from_archive_and_runs(study, tmp_path):
    archive(study, tmp_path / "results" / "published" / "study.parquet")
    out = tmp_path / "docs" / "page.md"
    assert main(["--results", str(tmp_path / "results"), "--out", str(out)]) == 0
    text = out.read_text()
    found = studies(Results(study))[0]
    for _, row in found.findings.iterrows():
        waits = row["these results"].startswith("no ")
        ours = f"| {row['these results']} |" if waits else f"| {row['these results']} | 160 | **{row.verdict}** |"
        assert f"| {row['the dissertation']} {ours}" in text
    assert found.counts.set_index("task").loc["1, circle"].sum() == (found.findings.task == "1, circle").sum()
    by_finding = text[: text.index("## Whose success")]  # there the verdicts are given again, by either reading
    for word in ("replicates", "differs"):
        said = len(re.findall(rf"^\| 1, circle \|.*\*\*{word}\*\* \|$", by_finding, re.MULTILINE))
        assert said == found.counts.set_index("task")[word]["1, circle"]
    for picture in re.findall(r"\]\((figures/[^)]+)\)", text):
        assert (out.parent / picture).is_file()
    assert "figures/replication/success-by-mutation-khepera.png" in text
    fresh = tmp_path / "docs" / "fresh.md"
    assert main(["--results", str(study), "--fresh", "--out", str(fresh)]) == 0
    part = [page.partition("## Finding by finding")[2].partition("## Readings")[0] for page in (text, fresh.read_text())]
    assert part[0] == part[1]


def test_runs_of_a_gpu_are_counted_on_the_page(study):
    assert _gpus(Results(study)) == []
    lines = _gpus(Results(ROOT / "results/published/study.parquet", archived=True))
    page = " ".join((ROOT / "docs/replication.md").read_text().split())
    assert lines
    assert all(line in page for line in lines)
    counts = [int(number.replace(",", "")) for number in re.findall(r"([\d,]+) of the (?:Khepera|snake)", " ".join(lines))]
    table = pq.read_table(ROOT / "results/published/study.parquet", columns=["versions"])
    assert sum(counts) == sum("device" in json.loads(text) for text in table["versions"].to_pylist())


def test_the_committed_page_is_of_the_committed_archive():
    said = described(ROOT / "results/published/study.parquet")
    assert f"{said['runs']:,} runs (`make replication`)" in (ROOT / "docs/replication.md").read_text()
    assert (ROOT / "results/published/study.parquet").stat().st_size < 30e6


@pytest.mark.parametrize(
    ("least", "combinations", "complete"), [(30, 500, True), (29, 500, False), (30, 499, False)], ids=str
)
def test_page_says_which_study_is_complete(least, combinations, complete):
    def study(robot, runs, of):
        tasks = pd.DataFrame({"least": [30, runs], "combinations": [500, of]})
        return SimpleNamespace(chosen=SimpleNamespace(robot=robot), tasks=tasks)

    said = page._state([study("khepera", least, combinations), study("snake", 5, 500)])
    assert ("The study of the Khepera is complete: 30 runs of each of the 500 combinations" in said) == complete
    assert f'"The study of the {"snake" if complete else "khepera and the snake"} is not complete"' in said
    assert "warning" not in page._state([study("snake", 30, 500)])
