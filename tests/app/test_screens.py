"""Screens without a browser: what they show of terms, of effects while a diagnosis works, of the snake and of networks."""

import asyncio
import json
import re
import threading

import pytest

import bns
from bns.cli.main import main
from bns.diagnose.data.variables import LABELS
from bns.diagnose.residuals.along_variables import CHANNELS, WORLD
from bns.examples import FOLDER
from tests.diagnose.residuals.test_established import warming
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, hidden, measured
from tests.hidden_snake.worlds import Hidden, World, driven

pytest.importorskip("panel", reason="the extra app (Panel) is not installed")

import panel as pn
from bokeh.document import Document

from bns.app.explore import tabs_of
from bns.app.figures.common import blank, entitle, label_ticks
from bns.app.html import found_errors, table
from bns.app.jobs import Jobs
from bns.app.log.part import Part
from bns.app.screens.data import DataScreen
from bns.app.screens.effects import EffectsScreen
from bns.app.screens.model import ModelScreen
from bns.app.screens.next import NextScreen
from bns.app.screens.where import WhereScreen
from bns.app.session import opened, session_yaml
from bns.app.tab import Tab
from bns.diagnose.data.variables import velocity

LOG = FOLDER / "khepera-log.csv"


class AtOnce:
    """Does every job at once; a failure is one of the test."""

    def run(self, _text, work, done, failed, later=False):
        done(work())

    def changed(self, _screen):
        pass


def entered(screen, tab):
    made = screen(tab, AtOnce())
    made.enter()
    return made


@pytest.fixture(scope="module")
def found():
    """Something that no listed effect explains."""
    barred = {"warm-up", *all_but_rivals_of("wheelbase")}
    return bns.diagnose(measured(warming(), trials=24, seed=3), bns.Model(NOMINAL), without_effects=sorted(barred))


@pytest.mark.slow
def test_a_term_is_a_switch_and_its_errors_are_those_of_the_summary(found):
    [term] = found.diagnosis.terms[:1]
    said = found_errors(found.diagnosis.errors_with_terms)
    errors = found.to_json()["error_with_terms"]["1s"]
    for key in ("before", "after"):
        assert f"<td>{1e3 * errors[key]:.2f}</td>" in said
    tab = tabs_of(found, "khepera").get("")[1]
    screen = entered(EffectsScreen, tab)
    label = f"{term.name}: add this term: {found.diagnosis.terms_in_words[0]}"
    assert label in screen._effects[term.name]._box.options
    assert "bns-found" in screen._diagnosis._work.said.object
    screen._effects[term.name]._box.value = [term.name]
    assert tab.now.on == (term.name,)
    assert [t.term for t in tab.now.terms] == [term.term]
    shown = tab.bench.shown(tab.now)  # test_workbench holds these numbers against those of `bns add`
    assert shown.names == ["as given", term.name]
    assert f"{1e3 * shown.errors.horizons['1s'].models[-1].rms_m:.2f}" in screen._errors.object
    screen._effects[term.name]._box.value = []
    assert tab.now.on == ()


def test_what_effects_earn_alone_stands_beside_them_while_the_diagnosis_works():
    log = bns.Measurements(measured(hidden(turn_slip={"slip_s": 0.12}), trials=12, commands=3))
    tab = Tab()
    tab.take(bns.Model(NOMINAL), ("khepera",))
    tab.open(log, "log.csv")
    screen = entered(EffectsScreen, tab)
    told = {}
    result = bns.diagnose(log, bns.Model(NOMINAL), fresh=True, alone=lambda entry: told.setdefault(entry["name"], entry))
    ranking = {entry["name"]: entry for entry in result.to_json()["ranking"]}
    assert set(told) == set(ranking)
    for key in ("elpd_diff", "dse", "p_value"):
        assert {name: entry[key] for name, entry in told.items()} == {name: entry[key] for name, entry in ranking.items()}
    tab.alone = {"turn-slip": told["turn-slip"]}
    screen._diagnosis._meanwhile()
    gain = f"{told['turn-slip']['elpd_diff']:+.3f}"
    assert f"alone, so far: {gain}" in screen._effects["turn-slip"]._text.object
    assert "alone" not in screen._effects["motor-lag"]._text.object


def test_effects_are_found_by_words_and_those_that_are_on_stay():
    tab = Tab()
    tab.open(LOG, "log.csv")
    screen = entered(EffectsScreen, tab)

    def shown():
        return [name for name, each in screen._effects.items() if each.view in screen._switches.objects]

    everything = shown()
    assert len(everything) > 70
    screen.switch("motor-lag", True)
    screen._sought.value_input = "Swing caster"
    assert "caster-swing" in shown()
    assert "wheelbase" not in shown()
    assert "motor-lag" in shown()
    titles = [part.object for part in screen._switches.objects if "<h2" in str(getattr(part, "object", ""))]
    assert not any("Clock" in title for title in titles)
    screen._sought.value_input = "<xyzzy>"
    assert shown() == ["motor-lag"]
    assert f"0 of {len(everything)} effects mention &lt;xyzzy&gt;" in screen._how_many.object
    screen.switch("motor-lag", False)
    assert shown() == ["motor-lag"]  # nothing goes away under the pointer
    screen._sought.value_input = "clock"
    assert "clock-drift" in shown()
    screen._sought.value_input = ""
    assert shown() == everything
    assert not screen._how_many.object


def test_velocities_stand_in_words_with_units():
    for channel in (*CHANNELS, *WORLD):
        assert re.search(r" \(.+\)$", velocity(channel)), channel
    tab = Tab()
    tab.open(LOG, "log.csv")
    said = entered(WhereScreen, tab)._explained.object
    assert "forward velocity (m/s)" in said
    for name in (*CHANNELS, *WORLD, *LABELS):
        if "_" in name:
            assert name not in said


def test_trials_have_the_names_of_the_log_in_the_picture_of_all_trials():
    tab = Tab()
    tab.open(LOG, "log.csv")
    screen = entered(WhereScreen, tab)
    names = [str(name) for name in tab.log.trials["trial"]]
    assert screen._pictures.trial.xaxis[0].major_label_overrides == dict(enumerate(names))


class Ticks:
    """A document whose next tick comes when the test says so; only the thread that made it may touch it."""

    def __init__(self):
        self.asked, self.thread = [], threading.get_ident()

    def add_next_tick_callback(self, act):
        assert threading.get_ident() == self.thread
        self.asked.append(act)

    def tick(self):
        due, self.asked = self.asked, []
        for act in due:
            act()


async def all_done(jobs):
    """Every job has ended, and the loop has had its turn."""
    jobs._pool.shutdown(wait=True)
    await asyncio.sleep(0)


def test_nothing_is_shown_before_the_browser_has_the_page():
    async def shown():
        document, said, done = Ticks(), [], []
        jobs = Jobs(document, said.append, lambda _by: None)
        jobs.run("first", lambda: 1, done.append, done.append)
        jobs.run("second", lambda: 2, done.append, done.append)
        await all_done(jobs)
        document.tick()
        assert (said, done) == ([], [])
        jobs.begin()
        document.tick()
        assert done == [1, 2]
        assert said == ["first", "second", ""]

    asyncio.run(shown())


def test_what_is_made_meanwhile_is_made_for_this_page():
    """Panel asks which page a part is for, twice: the main thread may have let go of its own in between."""

    async def made_for():
        document, made = Ticks(), []
        jobs = Jobs(document, lambda _text: None, lambda _by: None)
        jobs.begin()
        jobs.run("which page", lambda: pn.state.curdoc, made.append, made.append)
        await all_done(jobs)
        document.tick()
        assert made == [document]
        assert pn.state.curdoc is not document

    asyncio.run(made_for())


def test_a_job_that_ends_while_changes_are_held_back_is_shown():
    """Bokeh holds a request for the next tick back as well; one that came from another thread could be lost with the changes."""

    async def shown():
        document, made = Document(), []
        jobs = Jobs(document, lambda _text: None, lambda _by: None)
        document.hold()
        jobs.run("meanwhile", lambda: 1, made.append, made.append)
        jobs._pool.shutdown(wait=True)
        assert document.callbacks._held_events == []
        document.unhold()
        await asyncio.sleep(0)
        [asked] = document.session_callbacks
        jobs._begun = True
        asked.callback()
        assert made == [1]

    asyncio.run(shown())


def test_a_page_that_is_closed_is_shown_nothing_more():
    async def closed():
        document = Ticks()
        jobs = Jobs(document, lambda _text: None, lambda _by: None)
        jobs.run("too late", lambda: 1, lambda _one: None, lambda _why: None)
        jobs.end()
        await all_done(jobs)
        assert document.asked == []

    asyncio.run(closed())


def test_a_list_of_effects_that_could_not_be_made_is_made_with_the_next_picture():
    class FirstListFails(AtOnce):
        left = 1

        def run(self, text, work, done, failed, later=False):
            if later and self.left:
                self.left -= 1
                failed("Internal error")
            else:
                super().run(text, work, done, failed)

    tab = Tab()
    tab.open(LOG, "log.csv")
    screen = EffectsScreen(tab, FirstListFails())
    screen.enter()
    assert not screen._effects
    screen.update()
    assert "motor-lag" in screen._effects


@pytest.fixture(scope="module")
def snake(tmp_path_factory):
    path = tmp_path_factory.mktemp("snake") / "snake.parquet"
    driven(World("friction", "single", Hidden(friction=1.6), ("floor-friction",)), 1, 4, 4, True).to_parquet(path, index=False)
    return path


@pytest.fixture(scope="module")
def body(snake):
    tab = Tab()
    tab.take("snake", ("snake",))
    tab.open(str(snake), str(snake))
    return tab


@pytest.mark.slow
def test_the_paths_of_a_snakes_markers_are_drawn(body):
    screen = entered(DataScreen, body)
    data = screen._picture.paths.data
    assert set(data["marker"]) == {"yellow", "green"}
    assert len(set(data["color"])) == 2
    tracks = body.log.measured.tracks
    assert len(data["trial"]) == 2 * len(tracks)
    assert len(data["x"][0]) > tracks.first[1]  # what the camera saw within the cycles, too
    assert data["x"][0][0] == tracks.markers_m[0, 0, 0]


@pytest.mark.slow
def test_a_body_is_compared_and_switched_like_a_drive(body, capsys, snake):
    where = entered(WhereScreen, body)
    assert main(["compare", str(snake), "--model", "snake", "--json"]) == 0
    error = json.loads(capsys.readouterr().out)["error"]["cycle"]
    assert f"<td>{1e3 * error['position_m']:.2f}</td>" in where._errors.object
    assert "one cycle" in where._errors.object
    assert "floor-friction" in entered(EffectsScreen, body)._effects
    assert "12 joints" in entered(ModelScreen, body)._said.object
    screen = entered(EffectsScreen, body)
    screen.switch("floor-friction", True)
    shown = body.bench.shown(body.now)
    assert shown.names == ["as given", "floor-friction"]
    added = bns.add(str(snake), ["floor-friction"], "snake").to_json()
    assert json.loads(json.dumps(shown.numbers)) == json.loads(json.dumps(added["parameters"]))
    assert f"{1e3 * shown.errors.horizons['cycle'].models[-1].rms_m:.2f}" in screen._errors.object
    assert not screen._formula.visible
    following = entered(NextScreen, body)
    assert "floor-friction --model snake" in following._commands.object
    assert "extended.yaml" in following._model.object
    screen.switch("floor-friction", False)


def test_cycles_are_left_out_like_poses(body):
    row = int(body.log.frame.index[5])
    cycles = len(body.log.measured.tracks.gait)
    used = Part((), (row,), ()).of(body.log)
    assert len(used.measured.tracks.gait) == cycles - 1
    cut = Part((), (), (("0", 0.0, 4.0),)).of(body.log)
    tracks = cut.measured.tracks
    assert 0 < tracks.first[1] < body.log.measured.tracks.first[1]
    assert tracks.t_s[: tracks.first[1]].max() <= 4.0


def test_networks_are_compared_and_have_no_effects(snake, capsys, tmp_path):
    tab = tabs_of(str(snake), "snake-networks").get("")[1]
    assert tab.why_no_bench == ""
    where = entered(WhereScreen, tab)
    assert main(["compare", str(snake), "--model", "snake-networks", "--json"]) == 0
    error = json.loads(capsys.readouterr().out)["error"]["cycle"]
    assert f"<td>{1e3 * error['position_m']:.2f}</td>" in where._errors.object
    assert "no effects" in entered(EffectsScreen, tab)._problem.view.object
    assert "snake-networks" in entered(ModelScreen, tab)._said.object
    following = entered(NextScreen, tab)
    assert "bns compare" in following._commands.object
    assert "bns add" not in following._commands.object
    saved = tmp_path / "a.session.yaml"
    saved.write_text(session_yaml(tab))
    again = opened(saved)
    assert again.networks == "snake-networks"
    assert again.bench.of_networks


def test_what_is_brushed_is_marked_on_the_paths_of_its_trial():
    tab = Tab()
    tab.open(LOG, "log.csv")
    screen = entered(WhereScreen, tab)
    windows = screen._windows
    chosen = windows.index[windows["number"] == 4].tolist()[:2]
    screen._pictures.source.selected.indices = chosen
    assert screen._trial.value == 4
    t_s, measured = tab.bench.measured(4)
    marked = screen._path._marked.data
    assert len(marked["x"]) == 4  # measured and predicted, of two windows
    first = windows.loc[chosen[0]]
    inside = (t_s >= first["from_s"]) & (t_s <= first["t_s"])
    assert marked["x"][0].tolist() == measured[inside, 0].tolist()
    screen._trial.value = 5
    assert screen._path._marked.data["x"] == []


def test_the_error_over_time_has_a_band_and_the_floor_says_the_noise():
    tab = Tab()
    tab.open(LOG, "log.csv")
    screen = entered(WhereScreen, tab)
    for source in screen._pictures._bands.values():
        assert (source.data["low"] < source.data["high"]).all()
    noise = tab.bench.as_given.errors.horizons["1s"].noise_floor_m
    for picture in (screen._pictures.floor, screen._path.figure):
        assert f"{1e3 * noise:.2f} mm" in picture.title.text
    screen._horizon.value = "5s"
    noise = tab.bench.as_given.errors.horizons["5s"].noise_floor_m
    assert f"{1e3 * noise:.2f} mm" in screen._path.figure.title.text


def test_titles_have_lines_that_fit_a_narrow_window_below_a_line_of_icons():
    tab = Tab()
    tab.open(LOG, "log.csv")
    screen = entered(WhereScreen, tab)
    entitle(screen._path.figure, "Trial 2026-03-04-the-morning-on-the-concrete-floor-13; noise of the tracking: 3.11 mm")
    for picture in (*screen._pictures.all, screen._path.figure):
        assert not picture.toolbar_sticky  # beside the title, its icons lie over it
        assert picture.title.text
        assert max(map(len, picture.title.text.splitlines())) <= 46


def test_long_names_of_trials_stand_upright_along_the_axis():
    picture = blank("", "trial", "")
    label_ticks(picture, {0: "1", 1: "14"})
    assert (picture.xaxis[0].major_label_orientation, picture.height) == ("horizontal", 300)
    label_ticks(picture, {0: "concrete-1", 1: "concrete-2"})
    assert picture.xaxis[0].major_label_orientation == "vertical"
    assert picture.height > 350  # the labels take their room from no plot


def test_a_short_table_is_shown_whole_and_a_long_one_scrolls():
    assert "bns-long" not in table(["a", "b"], [["x", 1]] * 12)
    assert "bns-long" in table(["a", "b"], [["x", 1]] * 13)
