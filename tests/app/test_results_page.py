"""The page of a store: numbers are those of the store, a run driven again is the run."""

import pytest

import bns
from bns.app.results.study import Study, is_store
from bns.errors import StoreError

pytest.importorskip("panel", reason="the extra app (Panel) is not installed")
from tests.app.visits import figures, settled, shown, widest

pytestmark = pytest.mark.slow

QUICK = {"population_size": [8], "evaluations": [3], "training_iterations_per_evaluation": [2]}
TASKS = ["circle", "infinity", "complex"]


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    sweep = bns.Sweep(
        name="little", robot="khepera", grid={"task": TASKS, "mutation_rate": [0.1, 0.9], **QUICK}, seeds=2
    )
    assert sweep.run(folder, jobs=1).finished
    return folder


def test_the_table_holds_every_run_with_its_last_evaluation(results):
    study, evals = Study(results), bns.load(results)
    last = evals[evals["evaluation"] == 3].set_index("run_id")
    assert len(study.runs) == 12
    assert study.varied(study.runs) == ["mutation_rate"]
    for run in study.runs.to_dict("records"):
        assert run["diversity"] == last["diversity"][run["run_id"]]
        assert run["success"] == last["success"][run["run_id"]]
    assert len(study.chosen({"mutation_rate": [0.9], "task": ["circle"], "sweep": []})) == 2


def test_a_run_driven_again_is_the_run(results):
    study = Study(results)
    run_id = study.runs["run_id"][0]
    again = study.drive_again(run_id, lambda _share, _text: None)
    assert again.run_id == run_id
    assert again.evals["diversity"].tolist() == study.curve(run_id)["diversity"].tolist()


def test_what_is_no_store_is_said(tmp_path, results):
    assert not is_store(tmp_path)
    with pytest.raises(StoreError, match="holds no results of bns"):
        Study(tmp_path)
    with pytest.raises(StoreError, match="no name of a run"):
        Study(results).curve("x' OR 1=1 --")


def point_at_a_dot(page):
    """Until the path of the run under the pointer is drawn; dots are looked for row by row."""
    dots = figures(page).nth(1)
    dots.scroll_into_view_if_needed()
    settled(page)
    box = dots.bounding_box()
    named = page.locator("#bns-hovered")
    for y in range(60, int(box["height"]) - 50, 4):
        for x in range(50, int(box["width"]) - 10, 4):
            page.mouse.move(box["x"] + x, box["y"] + y)
            if page.get_by_text("run:").filter(visible=True).count():
                named.wait_for()
                assert "seed" in named.inner_text()
                page.get_by_text("The run under the pointer").wait_for()
                figures(page).nth(3).wait_for()
                return
    raise AssertionError("there is no dot")


def test_runs_are_filtered_compared_and_driven_again_in_the_browser(results, visit):
    visited = visit(results)
    page = visited.open()
    page.get_by_text("12 of 12 finished runs.").wait_for()
    assert figures(page).count() == 2  # no curve before a run is chosen
    page.get_by_role("checkbox", name="Look for new runs every 10 s").check()
    page.get_by_role("checkbox", name="Look for new runs every 10 s").uncheck()
    assert page.get_by_text("Orange (dots: triangles): no success").count() == 1
    assert page.get_by_text("0 where all controllers are alike").count() == 1
    page.get_by_label("Only mutation rate (none: all)").select_option("0.9")
    page.get_by_text("6 of 12 finished runs.").wait_for()
    point_at_a_dot(page)
    shown(page, "hovered")
    page.get_by_label("Run A", exact=True).select_option(index=1)
    page.locator("#bns-run-a").wait_for()
    page.get_by_label("Run B", exact=True).select_option(index=4)
    page.locator("#bns-run-b").wait_for()
    page.get_by_role("button", name="Repeat the run to see its path").first.click()
    figures(page).nth(4).wait_for()  # the path beside the two that are there from the start, the curve and that under the pointer
    settled(page)
    shown(page, "results")
    page.close()
    narrow = visited.open(400)
    narrow.get_by_text("12 of 12 finished runs.").wait_for()
    settled(narrow)
    shown(narrow, "results-narrow")
    assert widest(narrow) <= 400
