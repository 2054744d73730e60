"""The page as a reader finds it: in a browser, from the file system, on a wide and on a narrow screen."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from analysis.__main__ import main
from analysis.gallery import page
from analysis.publish import captions

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
NARROWEST = 500
"""Some builds of Chromium make no narrower window."""
QUIET = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--hide-scrollbars"),
)
# What the browser is asked for: pictures that did not load, and whether the page itself must be scrolled sideways.
PROBE = """<script>window.addEventListener("load", () => {
  const broken = [...document.images].filter(image => !image.naturalWidth).map(image => image.src);
  const wide = document.documentElement.scrollWidth > document.documentElement.clientWidth;
  const lost = [...document.querySelectorAll("nav a")].filter(a => !document.querySelector(a.getAttribute("href")));
  document.title = JSON.stringify({pictures: document.images.length, broken, wide, lost: lost.length,
                                   width: document.documentElement.clientWidth});
});</script></head>"""


@pytest.fixture(scope="module")
def drawn(real_results, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("figures")
    for name in ("success-by-mutation", "findings", "trials"):
        assert main(["--results", str(real_results), "--only", name, "--out", str(out)]) == 0
    return out


def browse(place: Path, width: int, profile: Path) -> str:
    command = [BROWSER, *QUIET, f"--user-data-dir={profile}", f"--window-size={width},900", "--dump-dom", place.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, timeout=600, check=True).stdout


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine; apt-get install chromium")
@pytest.mark.parametrize("width", [1280, 400])
def test_a_browser_shows_every_picture_from_the_file_system_and_scrolls_down_only(drawn, tmp_path, width):
    probed = drawn / f"probed-{width}.html"
    probed.write_text((drawn / "index.html").read_text().replace("</head>", PROBE))
    found = json.loads(html.unescape(re.search(r"<title>(.*?)</title>", browse(probed, width, tmp_path / "profile"))[1]))
    assert found.pop("width") <= max(width, NARROWEST)
    assert found == {"pictures": 2, "broken": [], "wide": False, "lost": 0}


def test_every_figure_has_a_section_with_its_caption_and_origin(drawn):
    text = (drawn / "index.html").read_text()
    for one in captions(drawn):
        assert f'<section id="{one["name"]}">' in text
        assert f"n = {one['n']:,} runs" in text
        assert all(spec in text for spec in one["spec_hashes"])
        assert all(f'href="{file}"' in text for file in one["files"])
    assert text.index('id="findings-khepera"') < text.index('id="trials-khepera"') < text.index('id="success-by')
    assert 'class="verdict undecided"' in text
    assert "http-equiv" not in text
    alone = (drawn / "findings.html").read_text()
    assert re.findall(r'<section id="(.*?)">', alone) == ["findings-khepera"]


def test_the_page_needs_nothing_from_elsewhere(drawn):
    text = (drawn / "index.html").read_text()
    assert not re.search(r'(src|href)="(https?:)?//', text)
    assert "<link" not in text


def test_a_page_that_is_watched_reloads_itself(tmp_path):
    assert '<meta http-equiv="refresh" content="7">' in page([], tmp_path, 7)


def test_what_was_not_drawn_stands_with_its_reason_and_strange_letters_do_no_harm(tmp_path):
    text = page([{"name": "a<b", "paper": "figure 9.9", "skipped": "1 < 2 & 'so'"}], tmp_path)
    assert "a&lt;b" in text
    assert "1 &lt; 2 &amp; &#x27;so&#x27;" in text


def test_figures_of_two_robots_are_told_apart(tmp_path):
    one = {
        "name": "success-first", "title": "Success", "paper": "figure 4.7", "shows": "", "see": "", "n": 1, "missing": [],
        "sweeps": ["a"], "files": [], "table": None, "spec_hashes": [], "bns_versions": ["1"], "git": [],
    }  # fmt: skip
    text = page([one, one | {"name": "success-second"}, one | {"name": "other", "title": "Other"}], tmp_path)
    assert re.findall(r"<h2>(.*?) <span", text) == ["Other", "Success, first", "Success, second"]
