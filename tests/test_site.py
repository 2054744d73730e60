"""The documentation site: it builds without a warning, asks no other host for anything, and has a page for every part."""

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import bns
from bns.cli.main import _parser
from bns.physics.effects import all_effects
from bns.registry import JOINT_EFFECTS
from site_pages.command_pages import page as command_page
from site_pages.drives import VALUES, Demonstration, demonstrate, visible_values
from site_pages.effect_pages import joints
from site_pages.effect_pages import page as effect_page

ROOT = Path(__file__).resolve().parent.parent
FETCHED = {
    "script": "src",
    "img": "src",
    "iframe": "src",
    "source": "src",
    "video": "src",
    "link": "href",
    "object": "data",
}
OTHER_HOST = re.compile(r"^(?:https?:)?//")


class Requests(HTMLParser):
    """Collects what a browser fetches by itself when it shows a page."""

    def __init__(self):
        super().__init__()
        self.addresses = []

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        if tag in FETCHED and found.get("rel") not in {"canonical", "next", "prev"}:
            self.addresses.append(found.get(FETCHED[tag]) or "")
        self.addresses += re.findall(r"url\(([^)]+)\)", found.get("style") or "")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site: that of `make docs` where BNS_SITE names it, else a fresh one."""
    if os.environ.get("BNS_SITE"):
        return Path(os.environ["BNS_SITE"])
    pytest.importorskip("material", reason="the extra docs is not installed")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-d", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert "WARNING" not in done.stderr
    return folder


@pytest.mark.slow
def test_no_page_asks_another_host_for_anything(site):
    pages = list(site.rglob("*.html"))
    assert len(pages) > 60
    for page in pages:
        requests = Requests()
        requests.feed(text := page.read_text())
        assert not [a for a in requests.addresses if OTHER_HOST.match(a.strip("'\""))], page
        assert 'class="mermaid"' not in text, "the theme would fetch a library for it"
    for sheet in site.rglob("*.css"):
        assert not re.findall(r"(?:url\(|@import )[\"']?(?:https?:)?//", sheet.read_text()), sheet


@pytest.mark.slow
def test_every_effect_has_a_page_with_its_picture(site):
    overview = (site / "gallery" / "effects.html").read_text()
    for name, effect in all_effects().items():
        page = (site / "gallery" / "effects" / f"{name}.html").read_text()
        assert f'src="{name}.svg"' in page
        assert (site / "gallery" / "effects" / f"{name}.svg").stat().st_size > 5000
        assert f'href="effects/{name}.html"' in overview
        for heading in ("Parameters", "Look-alikes", "Confirm it on the bench"):
            assert f">{heading}<" in page, name
        assert all(f"<code>{p.name}</code>" in page for p in effect.parameters)


def test_effects_of_joints_are_listed_with_no_blank_left():
    text = joints()
    assert len(JOINT_EFFECTS.names()) > 10
    for name in JOINT_EFFECTS.names():
        assert f"| {name} |" in text
    assert "{" not in text


@pytest.mark.slow
def test_every_public_name_has_its_docstring_on_the_page(site):
    page = (site / "reference" / "python.html").read_text()
    for name in bns.__all__:
        if not name.startswith("_"):
            assert f"bns.{name}" in page, name
    assert "Raises:" in page


@pytest.mark.parametrize("name", sorted(all_effects()))
def test_pictures_show_a_difference(name):
    shown = demonstrate(all_effects()[name])
    assert 0.01 < shown.apart_m.max() < 0.7


def test_of_a_compass_the_path_of_its_headings_is_drawn():
    shown = demonstrate(all_effects()["compass-deviation"])
    assert shown.by_heading
    lengths = [np.hypot(*np.diff(path, axis=0).T).sum() for path in (shown.plain_m, shown.with_effect_m)]
    assert lengths[0] == pytest.approx(lengths[1])
    assert not demonstrate(all_effects()["wheelbase"]).by_heading


def test_an_effect_of_a_package_has_a_picture_too():
    for effect in all_effects().values():
        values = visible_values(effect)
        assert effect.checked(values)
        assert values != effect.neutral
    assert set(VALUES) <= set(all_effects())


def test_the_command_reference_has_every_command_and_option():
    text = command_page()
    commands = _parser()._commands()
    assert len(commands) > 20
    for name, parser in commands.items():
        assert f"\n## bns {name}\n" in text
        section = text.split(f"\n## bns {name}\n")[1].split("\n## ")[0]
        assert all(option in section for action in parser._actions for option in shown_options(action)), name


def shown_options(action):
    return [] if action.help in {"==SUPPRESS=="} or action.dest == "help" else action.option_strings


def test_the_menu_names_pages_that_exist_once_each():
    named = re.findall(r"- ([\w/.-]+\.md)$", (ROOT / "mkdocs.yml").read_text(), flags=re.M)
    made = {"gallery/effects.md", "reference/commands.md", "reference/python.md"}
    assert len(named) == len(set(named))
    assert all((ROOT / "docs" / page).is_file() for page in set(named) - made)


BANNED = re.compile(
    r"\b(held against|mend(s|ed|ing)?|anew|gone on with|go(es)? on with|nobody is there|foret(ell|ells|old)|the source('s)?|"
    r"hold a model against|worth|heeds?|foresee\w*|afresh|luck)\b",
    re.IGNORECASE,
)
"""Words that are no plain technical English, or that have a term of their own in the glossary."""
PROSE = [*(ROOT / "docs").rglob("*.md"), ROOT / "bns" / "examples" / "files" / "README.md"]


def prose_of(page):
    """Line number and text of every line outside of blocks of code, links' addresses left out."""
    code = False
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if line.strip().startswith("```"):
            code = not code
        elif not code:
            yield number, line


@pytest.mark.parametrize("page", PROSE, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_pages_are_plain_english_in_short_lines(page):
    for number, line in prose_of(page):
        assert not BANNED.search(re.sub(r"`[^`]*`", "", line)), f"{page}:{number}: {line}"
        if not line.lstrip().startswith(("|", "#")):
            assert len(re.sub(r"\]\([^)]*\)", "]()", line)) <= 120, f"{page}:{number} is longer than 120 characters"


def test_help_is_plain_english():
    parsers = [_parser()]
    for parser in parsers:
        parsers += parser._commands().values()
        text = parser.format_help().replace("--mend", "")
        assert not (found := BANNED.search(text)), f"{parser.prog}: {found}"


PRIVATE = re.compile(BANNED.pattern + r"|\b(beside|told|share of|ways? (driven|of)|knows?|nearer together)\b", re.IGNORECASE)


def test_effects_are_described_in_plain_english():
    jointed = [getattr(part, "effect", part) for part in map(JOINT_EFFECTS.load, JOINT_EFFECTS.names())]
    for effect in (*all_effects().values(), *jointed):
        said = (effect.sentence, effect.sized, effect.residuals, effect.measurement, effect.caveat, effect.equation)
        for text in (*said, effect.assumes, effect.or_of_robot, *effect.beside.values(), *(p.text for p in effect.parameters)):
            assert not PRIVATE.search(text), f"{effect.name}: {text}"
        assert all(p.text.strip() and p.unit for p in effect.parameters), effect.name


def test_the_page_of_an_effect_says_what_of_the_robot_leaves_the_same_log():
    drawn = Demonstration({}, None, None, None)
    marker, scale = (effect_page(all_effects()[name], drawn) for name in ("marker-offset", "camera-scale"))
    assert "**Or the robot itself.** The same log results if the robot turns about another point than the midpoint" in marker
    assert "Or the robot itself" not in scale


def test_choices_name_files_that_exist():
    rows = [line for line in (ROOT / "docs" / "choices.md").read_text().splitlines() if line.startswith("|")]
    files = [
        match[1]
        for row in rows
        if (match := re.fullmatch(r"`([\w./-]+/[\w./-]*)`", row.rstrip("| ").split("|")[-1].strip()))
    ]
    assert len(files) > 20
    for file in files:
        assert (ROOT / "bns" / file).exists() or (ROOT / file).exists(), file


def test_links_of_the_documents_lead_somewhere_without_the_site():
    files = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "results").glob("*.md")]
    links = [(file, link) for file in files for link in re.findall(r"\]\(([^)#\s:]+)(?:#[^)]*)?\)", file.read_text("utf-8"))]
    assert len(links) > 100
    assert [(file.name, link) for file, link in links if not (file.parent / link).exists()] == []
