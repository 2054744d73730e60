from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from statsmodels.stats.proportion import proportion_confint
from store.synthetic import failed, record

from analysis.__main__ import figures, main
from analysis.intervals import wilson
from analysis.publish import KINDS, captions
from analysis.results import Results
from bns.cli.main import main as bns
from bns.errors import StoreError
from bns.spec import RunSpec
from bns.store import Writer, query

ROOT = Path(__file__).parents[2]


def test_wilson_agrees_with_the_formula_by_hand():
    # k = 3, n = 10, z = 1.959964: centre (k + z²/2) / (n + z²), half width z √(k (n - k) / n + z²/4) / (n + z²)
    low, high = wilson([3, 0, 10], [10, 10, 10])
    assert low == pytest.approx([0.10779, 0.0, 0.72247], abs=5e-6)
    assert high == pytest.approx([0.60322, 0.27753, 1.0], abs=5e-6)
    z2 = 1.959963984540054**2
    assert low[0] == pytest.approx((3 + z2 / 2 - np.sqrt(z2 * (2.1 + z2 / 4))) / (10 + z2))


def test_wilson_agrees_with_statsmodels_for_every_count_of_thirty():
    runs = np.repeat([1, 5, 30, 3000], 31)
    successes = np.minimum(np.tile(np.arange(31), 4), runs)
    theirs = proportion_confint(successes, runs, method="wilson")
    assert np.array(wilson(successes, runs)) == pytest.approx(np.array(theirs), abs=1e-12)


@pytest.mark.slow
def test_all_figures_come_with_their_captions_and_numbers(real_results, tmp_path, capsys):
    assert main(["--results", str(real_results), "--out", str(tmp_path)]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""  # no progress off a terminal
    assert "success-by-mutation-khepera.png  (figures 4.7 and 5.23, n = 20 runs)" in shown.out
    found = {caption["name"]: caption for caption in captions(tmp_path)}
    for name, caption in found.items():
        kinds = {path.suffix[1:] for path in tmp_path.glob(f"{name}.*")}
        wanted = {"json"} if "skipped" in caption else {"csv", "json"} if name.startswith("findings") else {*KINDS}
        assert kinds == wanted, name
    assert found["success-by-population"]["skipped"].startswith("no sweep compares population sizes (29 finished runs)")
    caption = found["success-by-mutation-khepera"]
    assert (caption["n"], caption["sweeps"], caption["missing"]) == (20, ["mutation"], [])
    hashes = query(real_results, "SELECT spec_hash FROM specs WHERE sweep = 'mutation'").spec_hash.tolist()
    assert caption["spec_hashes"] == hashes
    assert [one["sha"] for one in caption["git"]] == query(
        real_results, "SELECT DISTINCT git_sha FROM runs"
    ).git_sha.tolist()


def test_one_run_alone_has_its_figures_and_its_table_rows(real_results, tmp_path, capsys):
    run_id, seed = query(real_results, "SELECT run_id, seed FROM runs WHERE sweep = 'prototype' ORDER BY seed").iloc[1]
    assert main(["--results", str(real_results), "--run", run_id, "--out", str(tmp_path)]) == 0
    found = {caption["name"]: caption for caption in captions(tmp_path)}
    assert set(found) == {"paths-khepera-infinity", "trials-khepera", "one-run-khepera"}
    assert {caption["n"] for caption in found.values()} == {1}
    table = found["trials-khepera"]["table"]
    assert [row[table["columns"].index("seed")] for row in table["rows"]] == [str(seed)]
    capsys.readouterr()
    assert main(["--results", str(real_results), "--run", "r0", "--out", str(tmp_path)]) == 2
    assert "there is no run r0" in capsys.readouterr().err


def test_a_figure_drawn_again_has_the_same_bytes(real_results, tmp_path):
    for out in ("one", "two"):
        main(["--results", str(real_results), "--only", "success-by-diversity", "--out", str(tmp_path / out)])
    made = [path for path in sorted((tmp_path / "one").iterdir()) if path.suffix != ".html"]  # which has a date
    assert len(made) == 4
    assert [path.read_bytes() for path in made] == [(tmp_path / "two" / path.name).read_bytes() for path in made]


def test_figures_stand_below_the_results_unless_told(tmp_path):
    with Writer(tmp_path, "grid") as writer:
        for rate in (0.1, 0.5):
            writer.append(record(RunSpec(evaluations=3, mutation_rate=rate)))
    assert main(["--results", str(tmp_path), "--only", "success-by-mutation"]) == 0
    assert (tmp_path / "figures" / "success-by-mutation-khepera.svg").is_file()
    assert (
        Results(tmp_path).query("SELECT count(*) AS n FROM runs").n[0] == 2
    )  # the store takes them for nothing of its own


def test_an_unknown_figure_lists_those_there_are(tmp_path, capsys):
    assert main(["--results", str(tmp_path), "--only", "success-by-mutaton"]) == 2
    said = capsys.readouterr().err
    assert "unknown figure 'success-by-mutaton'. Did you mean 'success-by-mutation'?" in said
    assert all(name in said for name in figures())


def no_runs_yet(results):
    Writer(results, "none", sweep_text="name: none").__enter__().close()


@pytest.mark.parametrize("make", [lambda path: None, lambda path: path.mkdir(), no_runs_yet])
def test_an_empty_store_says_what_to_run(tmp_path, capsys, make):
    make(tmp_path / "results")
    assert main(["--results", str(tmp_path / "results")]) == 2
    assert "bns sweep khepera-small" in capsys.readouterr().err
    with pytest.raises(StoreError, match="no runs in"):
        Results(tmp_path / "results")


def test_a_figure_without_data_is_skipped_with_one_line(tmp_path, capsys):
    with Writer(tmp_path, "grid") as writer:
        writer.append(failed(RunSpec(mutation_rate=0.1)))
        writer.append(failed(RunSpec(mutation_rate=0.5)))
    assert main(["--results", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(figures()) + 1
    assert any(
        line.startswith("success-by-mutation (figures 4.7 and 5.23) skipped: 2 runs failed and none finished; run bns sweep")
        for line in lines
    )
    assert not list((tmp_path / "figures").glob("*.png"))
    assert "2 runs failed and none finished" in (tmp_path / "figures" / "index.html").read_text()


def test_a_figure_that_the_results_no_longer_give_goes_and_what_is_not_ours_stays(tmp_path):
    out = tmp_path / "figures"
    with Writer(tmp_path, "grid") as writer:
        for rate in (0.1, 0.5):
            writer.append(record(RunSpec(evaluations=3, mutation_rate=rate)))
    main(["--results", str(tmp_path)])
    assert (out / "success-by-mutation-khepera.png").exists()
    for name in ("notes.json", "run-circle-0.png"):
        (out / name).write_text("{}")
    shutil.rmtree(tmp_path / "runs")
    shutil.rmtree(tmp_path / "evals")
    with Writer(tmp_path, "other") as writer:
        writer.append(record(RunSpec(evaluations=3)))
    assert main(["--results", str(tmp_path)]) == 0
    assert {path.name for path in out.glob("*.png")} == {"run-circle-0.png"}
    assert (out / "notes.json").read_text() == "{}"
    assert not (out / "success-by-mutation-khepera.json").exists()


def test_a_compaction_under_way_does_not_disturb_a_figure(tmp_path):
    from bns.store import compact

    for half in range(2):
        with Writer(tmp_path, "grid") as writer:
            for rate in (0.1, 0.5):
                writer.append(record(RunSpec(seed=half, evaluations=3, mutation_rate=rate)))
    store = Results(tmp_path)
    before = store.query("SELECT count(*) AS n FROM evals").n[0]
    store.keep("kept", "SELECT run_id, evaluation FROM evals WHERE evaluation > 1")
    assert compact(tmp_path).files_after < 4
    assert store.query("SELECT count(*) AS n FROM evals").n[0] == before == 12
    assert store.query("SELECT count(*) AS n FROM kept").n[0] == 8


def test_figures_are_listed_without_waiting_for_the_compiler():
    listing = "import sys; from analysis.__main__ import figures; assert len(figures()) > 15; print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", listing], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize(
    "words",
    [["bogusname", "--results", "there"], ["--results", "there", "bogusname"], ["bogusname", "--results=there"]],
)
@pytest.mark.parametrize("command", ["figures", "watch"])
def test_a_word_beside_the_folder_of_results_is_refused(command, words, capsys):
    with pytest.raises(SystemExit) as ended:
        bns([command, *words])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert "bogusname has no meaning beside --results" in said
    assert "bns figures --only NAME" in said
    assert "old spelling" not in said


def test_beside_an_option_that_there_is_none_of_nothing_is_said_of_old_spellings(capsys):
    with pytest.raises(SystemExit) as ended:
        bns(["figures", "-o", "there"])
    assert ended.value.code == 2
    assert capsys.readouterr().err.splitlines() == ["bns: -o: unexpected argument. All options: bns figures --help"]


@pytest.mark.parametrize("words", [["approaches"], ["success-by-mutation", "--results", "there"]])
def test_the_name_of_a_figure_is_told_to_be_written_behind_only(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        bns(["figures", *words])
    assert ended.value.code == 2
    assert f"bns figures --only {words[0]}" in capsys.readouterr().err


def test_a_folder_with_the_name_of_a_figure_is_a_folder(tmp_path, monkeypatch, capsys):
    (tmp_path / "approaches").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("bns.plotting.scripts.carry_out", lambda results, *options: 0 if results == Path("approaches") else 1)
    assert bns(["figures", "approaches"]) == 0
    assert "write --results approaches" in capsys.readouterr().err


def test_the_pages_name_figures_behind_only():
    pages = [*(ROOT / "docs").rglob("*.md"), *(ROOT / "sweeps").glob("*.yaml"), *(ROOT / "bns" / "examples").rglob("*.md")]
    for page in (*pages, ROOT / "README.md", ROOT / "Makefile", ROOT / "CHANGELOG.md"):
        assert not re.search(r"bns figures [a-z]+[-a-z]*[ `\n]", page.read_text()), page
