"""Logs of very many poses: pictures are thinned, numbers are those of the command line."""

import json

import numpy as np
import pandas as pd
import pytest

import bns
from bns.cli.main import main
from bns.diagnose.data import tracker_faults
from bns.diagnose.data.tracks import MOST_FRAMES, tracks_of
from bns.diagnose.predict import paired_errors
from tests.app.test_screens import AtOnce
from tests.app.visits import error_of, go, settled
from tests.diagnose.worlds import NOMINAL, hidden, measured

pytest.importorskip("panel", reason="the extra app (Panel) is not installed")

from bns.app.figures.paths import LogFigure
from bns.app.screens.effects import EffectsScreen
from bns.app.screens.where import WhereScreen
from bns.app.tab import Tab
from bns.app.workbench import Workbench

DRAWN = 70_000
"""More points of all paths together make a browser slow."""


def repeated(table, times):
    """The same trials again under other names."""
    return pd.concat([table.assign(trial=table["trial"] + 1000 * n) for n in range(times)], ignore_index=True)


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    path = tmp_path_factory.mktemp("many") / "many.parquet"
    table = repeated(measured(hidden(turn_slip={"slip_s": 0.12}), trials=12, commands=8), 10)
    assert len(table) > 1.5 * MOST_FRAMES
    table.to_parquet(path, index=False)
    return path


@pytest.mark.slow
def test_numbers_of_many_poses_are_those_of_the_command_line(many, capsys):
    tab = Tab()
    tab.take(bns.Model(NOMINAL), ("khepera",))
    tab.open(str(many), str(many))
    where, effects = WhereScreen(tab, AtOnce()), EffectsScreen(tab, AtOnce())
    where.enter()
    effects.enter()
    assert main(["compare", str(many), "--model", "khepera", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)["error"]
    for horizon in ("1s", "trial"):
        assert f"<td>{1e3 * said[horizon]['position_m']:.2f}</td>" in where._errors.object
    assert f"<td>{1e3 * said['1s']['position_m']:.2f}</td>" in effects._errors.object
    used = len(tab.bench.ready.predictor.tracks.t_s)
    assert f"{used} of {len(tab.log.measured.tracks.t_s)} poses are used" in effects._errors.object


def test_what_does_not_depend_on_the_model_is_worked_out_once(many):
    """Of thousands of trials the bootstrap's draws take longer than all else of the first picture."""
    bench = Workbench(str(many), bns.Model(NOMINAL))
    paired_errors._drawn.cache_clear()
    assert bench.as_given
    trials = len(bench.ready.predictor.tracks)
    assert paired_errors._drawn.cache_info().misses == 1
    drawn = np.random.default_rng(paired_errors._SEED).multinomial(trials, np.full(trials, 1 / trials), size=paired_errors.DRAWS)
    assert np.array_equal(paired_errors._drawn(trials), drawn)


def test_paths_of_a_million_poses_are_drawn_thinned():
    paths = [(str(n), "", np.zeros((10_000, 3))) for n in range(100)]
    figure = LogFigure()
    figure.fill(paths, {"x": [], "y": [], "text": []})
    assert sum(map(len, figure.paths.data["x"])) <= DRAWN
    assert "drawn" not in figure.figure.title.text
    many = [(str(n), "", np.zeros((100, 3))) for n in range(10_000)]
    figure.fill(many, {"x": [], "y": [], "text": []})
    assert sum(map(len, figure.paths.data["x"])) <= DRAWN
    assert "one of 2 paths is drawn" in figure.figure.title.text
    one = [("0", "", np.zeros((1_000_000, 3)))]
    figure.fill(one, {"x": [], "y": [], "text": []})
    assert len(figure.paths.data["x"][0]) <= DRAWN


def slowly(tracks, trial, t_s):
    """The fastest commanded wheel near each time, one by one."""
    ends = np.cumsum(tracks.duration_s[trial])
    speed = np.maximum(np.abs(tracks.left_m_s[trial]), np.abs(tracks.right_m_s[trial]))
    near = tracker_faults.AROUND_S
    out = []
    for t in t_s:
        first = min(int(np.searchsorted(ends, t - near)), len(ends) - 1)
        last = min(int(np.searchsorted(ends, t + near)), len(ends) - 1)
        out.append(max(speed[first : last + 1]))
    return np.array(out)


def test_the_fastest_wheel_nearby_is_that_of_the_slow_search():
    tracks = tracks_of(measured(NOMINAL, trials=3, commands=8))
    for trial in range(3):
        t_s = tracks.t_s[tracks.first[trial] : tracks.first[trial + 1]]
        assert np.array_equal(tracker_faults._fastest(tracks, trial, t_s), slowly(tracks, trial, t_s))


DRAWN_IN_THE_BROWSER = """() => {
  const sources = [...Bokeh.documents[0]._all_models.values()].filter(one => one.type === "ColumnDataSource")
  const points = (column) => [...column].reduce((n, one) => n + (one?.length > 1 && typeof one !== "string" ? one.length : 1), 0)
  const columns = (data) => data instanceof Map ? [...data.values()] : Object.values(data)
  return sources.map(one => Math.max(0, ...columns(one.data).map(points)))
}"""


@pytest.mark.slow
def test_a_million_poses_open_in_a_browser_thinned_with_numbers_of_the_command_line(tmp_path, visit):
    table = measured(hidden(turn_slip={"slip_s": 0.12}), trials=40, commands=8)
    table = repeated(table, -(-1_000_000 // len(table)))
    path = tmp_path / "million.parquet"
    table.to_parquet(path, index=False)
    page = visit(path, bns.Model(NOMINAL)).open()
    before = error_of(page, "as given")
    said = bns.compare(path, bns.Model(NOMINAL)).to_json()["error"]["1s"]
    assert before == round(1e3 * said["position_m"], 2)
    page.get_by_role("checkbox", name="turn-slip:").wait_for()
    assert 0 < sum(page.evaluate(DRAWN_IN_THE_BROWSER)) <= DRAWN
    go(page, "Data", "#bns-log")
    settled(page)
    assert f"{len(table)} poses" in page.locator("#bns-log").inner_text()
    assert 10_000 < max(page.evaluate(DRAWN_IN_THE_BROWSER)) <= DRAWN
