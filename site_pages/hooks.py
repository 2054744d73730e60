"""MkDocs calls these while it builds the site: they add the generated pages, and keep the site free of other hosts."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parent.parent
if str(ROOT) not in sys.path:  # `mkdocs` as a program of its own has the folder of the program there
    sys.path.insert(0, str(ROOT))

from site_pages import command_pages, effect_pages, python_page  # noqa: E402  # found through the line above


def generated() -> Iterator[tuple[str, str | bytes]]:
    """Path below docs/ and content of everything that is made from the code."""
    yield from effect_pages.pages()
    yield command_pages.PAGE, command_pages.page()
    yield python_page.PAGE, python_page.page()


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Complete the menu: the decision records, and pages of docs/ that it does not name go to the how-to guides."""
    docs = Path(config.docs_dir)
    sections = {title: pages for section in config.nav for title, pages in section.items()}
    records = next(page for page in sections["Explanations"] if isinstance(page, dict))["Decision records"]
    records += sorted(f"decisions/{page.name}" for page in docs.glob("decisions/0*.md"))
    named = {page for pages in sections.values() for page in pages if isinstance(page, str)}
    sections["How-to guides"] += sorted(page.name for page in docs.glob("*.md") if page.name not in named)
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages to those of the folder docs/, where a few have stand-ins for readers without the site."""
    for path, content in generated():
        stand_in = files.get_file_from_path(path)
        if stand_in is not None:
            files.remove(stand_in)
        files.append(File.generated(config, path, content=content))
    return files
