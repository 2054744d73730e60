"""What docs/approaches.md says of the comparison is what its published archive gives."""

from pathlib import Path

import pandas as pd
import pytest

from analysis import approach_pairs, approach_summary, ceiling, ensembles, limits, polishing
from analysis.results import Results

ROOT = Path(__file__).parents[2]
ARCHIVE = ROOT / "results" / "published" / "approaches.parquet"
TEXT = (ROOT / "docs" / "approaches.md").read_text()


def test_the_tables_are_those_of_the_archive():
    drawn = approach_summary.draw(Results(ARCHIVE, archived=True))
    assert [(one.data.runs.min(), one.n) for one in drawn] == [(60, 600), (60, 600), (40, 200)]
    for one in drawn:
        rows = [[f"`{name}`", *cells] for name, *cells in one.table.to_numpy().tolist()]
        assert "\n".join(f"| {' | '.join(row)} |" for row in rows) in TEXT
        assert f"| {' | '.join(one.table.columns)} |" in TEXT


@pytest.mark.slow
def test_what_is_said_of_pairs_is_what_the_archive_gives():
    figures = approach_pairs.draw(Results(ARCHIVE, archived=True))
    drawn = {one.name.removeprefix("approach-pairs-approaches-"): one.data for one in figures}

    def p(world, one, other, measure="late"):
        own = drawn[world]
        here = own[own[["one", "other"]].isin([one, other]).all(axis=1)]
        return float(here[f"{measure}_p_holm"].iloc[0])

    on_models = ["anytime+window=60", "back-to-reality", "estimation-exploration+tests=0.15", "transferability+every=2"]
    all_of_them = {"bns", "on-robot", "precomputed", "then-on-robot+data=0.5", *on_models}
    assert "with adjusted p below 0.01" in " ".join(TEXT.split())
    for world in ("khepera-physics", "khepera-substitute"):
        for first in ("bns+margin=0.03", "bns+noise=16"):
            assert max(p(world, first, other) for other in all_of_them) < 0.01
        assert p(world, "bns", "precomputed") < 0.01
        assert max(p(world, "on-robot", other) for other in all_of_them - {"on-robot"}) < 0.01
    physics, substitute = ("khepera-physics", "khepera-substitute")
    rounded = {w: round(p(w, "bns+margin=0.03", "bns+noise=16"), 2) for w in (physics, substitute)}
    assert rounded == {physics: 0.73, substitute: 0.03}
    rounded = {w: round(p(w, "bns", "then-on-robot+data=0.5"), 2) for w in (physics, substitute)}
    assert rounded == {physics: 0.02, substitute: 0.04}
    assert round(p(physics, "bns", "anytime+window=60"), 2) == 0.03
    assert min(p(physics, "bns", other) for other in on_models if other != "anytime+window=60") > approach_pairs.LEVEL
    assert min(p(substitute, "bns", other) for other in on_models) > approach_pairs.LEVEL
    for one in ("bns", "bns+margin=0.03"):
        for other in ("precomputed", "then-on-robot+data=0.5"):
            assert p("snake-snake-substitute", one, other, "minutes") < 0.01
    snake = drawn["snake-snake-substitute"]
    certain = snake[snake.late_p_holm < approach_pairs.LEVEL]
    assert certain[["one", "other"]].to_numpy().tolist() == [
        ["bns", "precomputed"],
        ["bns+margin=0.03", "precomputed"],
        ["precomputed", "then-on-robot+data=0.5"],
    ]


def test_what_is_said_of_missed_goals_that_count_more_is_what_its_archive_gives():
    rows = limits.evaluations(Results(limits.PUBLISHED / "noise-late.parquet", archived=True), limits.LATE)
    said = limits.late_in_words(rows, pd.read_csv(limits.PUBLISHED / "noise-late-drives.csv"))
    assert len(said) == 6
    assert "\n".join(said) in TEXT


def test_what_is_said_of_networks_and_generations_is_what_the_archives_give():
    published = limits.PUBLISHED
    rows = ensembles.evaluations(published / "noise-ensemble.parquet")
    driven = ensembles.drives(published / "noise-ensemble-drives.csv")
    said = limits.late_in_words(rows, driven, "{}")
    assert len(said) == 3 * len(ensembles.CELLS)
    assert "\n".join(said) in TEXT
    table = ensembles.changes(rows, driven)
    for measure in ("last", "world"):
        assert "\n".join(ensembles.changes_in_words(table, measure)) in TEXT


def test_what_is_said_of_polishing_is_what_the_archives_give():
    rows = polishing.evaluations(limits.PUBLISHED / "noise-polish.parquet")
    driven = polishing.drives(limits.PUBLISHED / "noise-polish-drives.csv")
    said = limits.late_in_words(rows, driven, "{}")
    assert len(said) == 6
    assert "\n".join(said) in TEXT
    assert "\n".join(polishing.changes_in_words(polishing.changes(rows, driven))) in TEXT


def test_what_is_said_of_noise_is_what_its_archive_and_its_drives_give():
    published = limits.PUBLISHED
    rows = limits.evaluations(Results(published / "noise.parquet", archived=True))
    assert "\n".join(limits.in_words(limits.compared(rows))) in TEXT
    elsewhere = limits.evaluations(Results(published / "noise.parquet", archived=True), limits.PHYSICS)
    assert "\n".join(limits.in_words(limits.compared(elsewhere))) in TEXT
    found = limits.limits(pd.read_csv(published / "noise-drives.csv"))
    assert found.runs.unique().tolist() == [20]
    assert "\n".join(limits.limits_in_words(found)) in TEXT


@pytest.mark.slow
def test_known_controllers_succeed_as_often_as_is_said():
    possible = ceiling.summary(pd.read_csv(limits.PUBLISHED / "ceiling.csv"))
    flat = " ".join(TEXT.split())
    for row in possible.itertuples():
        name = {"infinity": "infinity sign"}.get(row.task, row.task)
        assert f"{row.success:.1f} % ({name}, {row.commands}" in flat
