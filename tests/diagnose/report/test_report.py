"""The page as a reader finds it: every verdict said plainly, alone from the file system, on a wide and on a narrow screen."""

import html
import json
import re
import shutil
import subprocess
from functools import cache
from types import SimpleNamespace

import pandas as pd
import pytest

from bns.cli.main import main
from bns.diagnose import values
from bns.diagnose.comparison import compare
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.predict.paired_errors import Change
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report import tables
from bns.diagnose.report.plain_language import _rounded_up, figures_in_words
from bns.diagnose.report.shown_paths import shown_paths
from bns.diagnose.report.tables import error_table
from bns.diagnose.report.text import _ranking, comparison_text
from bns.measurements import write_measurements
from bns.physics.effects import effect_named
from bns.physics.formula import formula_effect
from bns.physics.order import ORDER
from bns.registry import EFFECTS
from tests.diagnose.residuals.test_worst_trials import held_from
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, hidden, measured

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
NARROWEST = 500
"""Some builds of Chromium make no narrower window."""
QUIET = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--hide-scrollbars", "--enable-logging=stderr"),
)
# What the browser is asked for: pictures that did not load, sideways scrolling, whether the slider and the list of trials work.
PROBE = """<script>window.addEventListener("load", () => {
  const at = id => document.getElementById(id), told = () => at("now").textContent;
  const broken = [...document.images].filter(image => !image.naturalWidth).length;
  const wide = document.documentElement.scrollWidth > document.documentElement.clientWidth;
  const whole = [...document.querySelectorAll("section > .cards, .picture, pre")];
  const cut = whole.filter(e => e.scrollWidth > e.clientWidth + 1).length;
  const lost = [...document.querySelectorAll("nav a")].filter(a => !document.querySelector(a.getAttribute("href"))).length;
  const last = told(), bottom = at("verdict").getBoundingClientRect().bottom;
  at("time").value = 0;
  at("time").dispatchEvent(new Event("input"));
  const first = told();
  at("trial").value = 1;
  at("trial").dispatchEvent(new Event("change"));
  document.title = JSON.stringify({broken, wide, cut, lost, first, last, other: told(), bottom,
    rows: at("poses").rows.length, lines: at("floor").querySelectorAll("path").length});
});</script></head>"""
WORLDS = {
    "none": (NOMINAL, {}),
    "effects": (hidden(turn_slip={"slip_s": 0.12}), {}),
    "tie": (hidden(dead_zone={"width_m_s": 0.006}), {"speeds": (0.085, 0.115)}),
    "unlisted": (NOMINAL.with_active(formula_effect("nap", "k * v * sin(heading)", "v"), (0.3,)), {"trials": 24}),
    "insufficient-data": (NOMINAL, {"trials": 4}),
}


@pytest.fixture(scope="module")
def page_of(tmp_path_factory):
    """The page of a verdict, made when it is first asked for."""
    folder = tmp_path_factory.mktemp("pages")

    @cache
    def made(verdict):
        model, how = WORLDS[verdict]
        data, out = folder / f"{verdict}.csv", folder / f"{verdict}.html"
        write_measurements(measured(model, **({"trials": 12, "ends_only": True, "seed": 4} | how)), data)
        assert main(["report", str(data), "--model", "khepera", "--minutes", "2", "-o", str(out)]) == 0
        return out

    return made


def first_screen(page):
    return html.unescape(re.sub(r"<[^>]+>", " ", page.read_text().partition("<nav>")[0].partition("</style>")[2]))


def browse(page, width, profile):
    command = [BROWSER, *QUIET, f"--user-data-dir={profile}", f"--window-size={width},900", "--dump-dom", page.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, timeout=600, check=True)


@pytest.mark.parametrize("verdict", WORLDS)
@pytest.mark.slow
def test_every_verdict_has_a_page_that_needs_nothing_else(page_of, verdict):
    text = page_of(verdict).read_text()
    assert f"verdict: {verdict}" in text
    assert len(text) < 5e6
    assert not re.search(r'(src|href)="(?!#|data:)', text)
    assert "url(" not in text
    assert not re.search(r"object at 0x|\bNone\b|\bnan\b", first_screen(page_of(verdict)))
    sections = set(re.findall(r'<section id="(\w+)">', text))
    assert {"paths", "error", "where", "next", "details"} <= sections
    assert ("ranking" in sections) == (verdict != "insufficient-data")
    assert set(re.findall(r'href="#(\w+)"', text)) == sections


@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        pytest.param("none", "Nothing is missing", marks=pytest.mark.slow),
        pytest.param("effects", "turning costs forward speed", marks=pytest.mark.slow),
        pytest.param("tie", "every wheel loses a constant part of its speed to friction; or ", marks=pytest.mark.slow),
        pytest.param("unlisted", "none of the known effects", marks=pytest.mark.slow),
        ("insufficient-data", "do not suffice"),
    ],
)
def test_the_first_screen_says_it_plainly(page_of, verdict, said):
    assert said in first_screen(page_of(verdict))


@pytest.mark.slow
def test_moments_that_stand_out_are_on_the_first_screen(tmp_path):
    data, out = tmp_path / "held.csv", tmp_path / "held.html"
    write_measurements(held_from(measured(NOMINAL, trials=40, seed=2), {3: 0.05, 17: 0.05, 22: 0.9, 31: 0.9}), data)
    barred = [word for name in all_but_rivals_of("wheelbase") for word in ("--without-effect", name)]
    assert main(["report", str(data), "--model", "khepera", "--minutes", "2", "-o", str(out), *barred]) == 0
    assert re.search(r"In 4 of 40 trials the error is large for a moment; the worst is trial \d+ at", first_screen(out))


def test_a_trial_that_begins_at_a_mistaken_marker_is_shown_last():
    table = measured(hidden(turn_slip={"slip_s": 0.12}), trials=12, ends_only=True, seed=2)
    first = table.groupby("trial", sort=False).head(1).index[5]
    table.loc[first, "heading_rad"] += 1.5
    predictor = WheelPredictor(tracks_of(table))
    shown = shown_paths(predictor, NOMINAL, Diagnosis("none", None))
    assert shown[-1]["name"] == "5"
    assert len(shown) == 12
    assert len(shown[0]["measured"]) == 2 * len(shown[0]["t"])


def test_the_first_screen_has_the_effects_size_and_its_uncertainty_with_units(page_of):
    told = first_screen(page_of("effects"))
    size, low, high = re.search(r"turn-slip\s+([0-9.]+) s/rad.*?interval ([0-9.]+) to ([0-9.]+) s/rad", told, re.S).groups()
    assert float(low) < float(size) < float(high)
    assert float(low) < 0.12 < float(high)
    assert re.search(r"predictions a \w+ ahead have an error of [0-9.]+ mm instead of [0-9.]+ mm", told)


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine; apt-get install chromium")
@pytest.mark.slow
@pytest.mark.parametrize(("verdict", "width"), [("effects", 1280), ("effects", 400), ("none", 400)])
def test_a_browser_shows_it_without_an_error_and_the_slider_moves(page_of, tmp_path, verdict, width):
    probed = tmp_path / "probed.html"
    probed.write_text(page_of(verdict).read_text().replace("</head>", PROBE))
    done = browse(probed, width, tmp_path / "profile")
    assert "CONSOLE" not in done.stderr
    found = json.loads(html.unescape(re.search(r"<title>(.*?)</title>", done.stdout)[1]))
    assert (found["broken"], found["wide"], found["cut"], found["lost"]) == (0, False, 0, 0)
    assert found["first"].startswith("error at 0.0 s: model as given 0 mm")
    assert len({found["first"], found["last"], found["other"]}) == 3
    assert found["rows"] > 3
    assert found["lines"] == (4 if verdict == "effects" else 3)  # the scale, and one a path
    assert found["bottom"] < 900


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["-o", "a.pdf"], "ends in .html"), (["-o", "gone/a.html"], "there is no folder"), (["--minutes", "-1"], "above 0")],
)
def test_what_cannot_be_asked_is_refused_and_nothing_written(tmp_path, monkeypatch, arguments, message, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["report", "none.csv", "--model", "khepera", *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_letters_that_mean_something_to_a_browser_do_no_harm(tmp_path):
    data, out = tmp_path / "a<b>&.csv", tmp_path / "page.html"
    table = measured(NOMINAL, trials=3, ends_only=True)
    table["trial"] = "</script><b>" + table["trial"].astype(str)
    write_measurements(table, data)
    assert main(["report", str(data), "--model", "khepera", "-o", str(out)]) == 0
    text = out.read_text()
    assert "a&lt;b&gt;&amp;.csv" in text
    assert "</script><b>" not in text


def test_mostly_single_poses_have_a_page_that_says_what_is_wrong(tmp_path):
    data, out = tmp_path / "single.csv", tmp_path / "page.html"
    table = measured(NOMINAL, trials=13, ends_only=True)
    single = table[table["trial"] > 0].groupby("trial").head(1)
    write_measurements(pd.concat([table[table["trial"] == 0], single]), data)
    assert main(["report", str(data), "--model", "khepera", "-o", str(out)]) == 0
    assert "only one tracked pose" in first_screen(out)


@pytest.mark.parametrize(
    ("number", "said"),
    [
        ((0.0903, 0.0896, 0.0911, "s"), ("90.3 ms", "89.6 to 91.1 ms")),
        ((-0.03, -0.04, -0.02, "rad"), ("-1.7°", "-2.3 to -1.1°")),
        ((1.06, 1.055, 1.065, "1"), ("1.060", "1.055 to 1.065")),
        ((0.5, None, None, "m"), ("500 mm", "")),
        ((1547.4, 1547.4, 1547.4001, "s"), ("1547 s", "")),
        ((0.0, 0.0, 0.0, "s"), ("0 ms", "")),
    ],
)
def test_numbers_are_rounded_to_what_is_known_of_them(number, said):
    assert figures_in_words(*number) == said


def test_every_listed_effect_is_described_in_everyday_words():
    words = {name: effect_named(name).in_words for name in EFFECTS.own}
    assert all("effect “" not in text for name, text in words.items() if name in ORDER)
    assert all(word not in text for text in words.values() for word in ("omega", "residual", "parameter"))


@pytest.mark.slow
def test_a_gain_by_chance_is_that_of_the_best_of_all_effects_that_were_tried(page_of):
    """One in twenty thousand for one effect is not that for the best of thirty."""
    said = re.search(r"to any of the (\d+) effects tried is at most ([0-9.e-]+)\.", page_of("effects").read_text())
    tried, chance = int(said[1]), float(said[2])
    assert tried > 20
    assert chance >= tried * 5e-5


def test_an_effect_that_was_found_and_is_not_in_the_ranking_is_named_beside_it():
    """As where a screening came before it, of a body on joints."""
    first = SimpleNamespace(ranking=[], decoy_threshold=0.1)
    lines = list(_ranking(SimpleNamespace(selection=SimpleNamespace(steps=[first]), effects=("servo-delay",))))
    assert "  (not tried alone, but found later in the search: servo-delay)" in lines
    lines = list(_ranking(SimpleNamespace(selection=SimpleNamespace(steps=[first]), effects=())))
    assert not any("not tried alone, but" in line for line in lines)


def test_why_effects_are_not_considered_is_explained_below_their_list():
    gain = SimpleNamespace(elpd_diff=1.0, dse=0.1, p_value=0.01)
    reasons = ("k is at its bound, 5 s", "")
    one, other = (SimpleNamespace(name="x", rejected_because=why, paired_comparison=gain) for why in reasons)
    said = "  (not considered: alone, it fits only with a number that no robot has"
    for ranking, explained in (([one, other], True), ([other], False)):
        first = SimpleNamespace(ranking=ranking, decoy_threshold=0.1)
        lines = list(_ranking(SimpleNamespace(selection=SimpleNamespace(steps=[first]), effects=("x",))))
        assert any(line.startswith(said) for line in lines) == explained


def test_a_bound_that_is_rounded_stays_a_bound():
    for bound, said in ((0.00215, 0.003), (0.002, 0.002), (0.96, 1.0), (1.0, 1.0), (0.0, 0.0), (3e-7, 3e-7), (9.01e-5, 1e-4)):
        assert _rounded_up(bound) == pytest.approx(said, rel=1e-6)


@pytest.mark.parametrize(
    ("effects", "terms", "columns"),
    [
        ((), False, ["as given (mm)"]),
        (("one",), False, ["as given (mm)", "with the effects (mm)"]),
        ((), True, ["as given (mm)", "with what is left described, too (mm)"]),
        (("one",), True, ["as given (mm)", "with the effects (mm)", "with what is left described, too (mm)"]),
    ],
)
def test_the_table_of_errors_has_every_model_of_the_answer(effects, terms, columns):
    models = [SimpleNamespace(rms_m=n / 1000, median_m=n / 2000) for n in range(30, 30 - 10 * len(columns), -10)]
    at = SimpleNamespace(horizon="1s", windows=7, models=models, total=None, noise_floor_m=0.002)
    errors = SimpleNamespace(horizons={"1s": at})
    d = SimpleNamespace(effects=effects, errors=None if terms else errors, errors_with_terms=errors if terms else None)
    d.terms_rejected = False
    table = error_table(d, None)
    assert table["columns"][1 : 1 + len(columns)] == columns
    said = [cell.partition(" ")[0] for cell in table["rows"][0][1 : 1 + len(columns)]]
    assert said == [f"{1e3 * m.rms_m:.1f}" for m in models]
    assert ("change, 95 % (mm)" in table["columns"]) == (len(columns) > 1)


@pytest.mark.parametrize("effects", [(), ("one",)])
def test_the_change_of_the_error_leads_to_the_last_model_that_is_accepted(effects):
    """Terms that raise the error are shown, and are no part of the model whose gain is told."""
    models = [SimpleNamespace(rms_m=n / 1000, median_m=n / 2000) for n in (30, 20, 25)[: 2 + len(effects)]]
    fell, rose = Change(-0.01, -0.012, -0.008), Change(0.005, 0.004, 0.006)
    changes, total = ((fell, rose), Change(-0.005, -0.007, -0.003)) if effects else ((rose,), rose)
    at = {"horizon": "1s", "windows": 7, "models": models, "changes": changes, "total": total, "noise_floor_m": 0.002}
    errors = SimpleNamespace(horizons={"1s": SimpleNamespace(**at)})
    d = SimpleNamespace(effects=effects, errors=None, errors_with_terms=errors, terms_rejected=True)
    table = error_table(d, None)
    assert "with a term that was rejected (mm)" in table["columns"]
    shown = dict(zip(table["columns"], table["rows"][0], strict=True))
    assert shown.get("change, 95 % (mm)") == ("-12.00 to -8.00" if effects else None)
    d.terms_rejected = False
    table = error_table(d, None)
    assert dict(zip(table["columns"], table["rows"][0], strict=True))["change, 95 % (mm)"] == (
        "-7.00 to -3.00" if effects else "+4.00 to +6.00"
    )


def test_the_parameters_of_a_term_come_in_their_order_and_with_intervals(monkeypatch):
    number = {"value": 0.5, "se": 0.01, "low": 0.48, "high": 0.52, "unit": "s", "at_bound": False}
    monkeypatch.setattr(values, "numbers_of", lambda _: {"t": dict.fromkeys(("k0", "k10", "k2"), number)})
    found = values.numbers_of_term(SimpleNamespace(fit=None, name="t"))
    assert list(found) == ["k0", "k2", "k10"]
    assert tables.in_line(found) == "k0 500 ms (480 to 520 ms); k2 500 ms (480 to 520 ms); k10 500 ms (480 to 520 ms)"


def test_a_comparison_of_one_trial_says_that_it_has_no_standard_error():
    one, two = (
        comparison_text(compare(WheelPredictor(tracks_of(measured(NOMINAL, trials=count, seed=3))), NOMINAL)) for count in (1, 2)
    )
    assert one.startswith("1 trial, ")
    assert "one trial has no standard error" in one
    assert "±" not in one
    assert "±: standard error over trials" in two
