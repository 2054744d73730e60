"""`bns.explore`: the page in a browser on this machine."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from bns.api.diagnose import DiagnoseResult
from bns.api.measurements import Log
from bns.api.model import Given
from bns.app.background import Background
from bns.app.results.study import Study, is_store
from bns.app.session import is_session, opened
from bns.app.tab import FIRST_MODEL, Tab, Tabs, files_of
from bns.errors import DataError
from bns.extras import require


class Explorer:
    """A page that is being served; ``address`` opens it in a browser on this machine."""

    def __init__(self, shown: Tabs | Study, port: int = 0) -> None:
        require("app", "panel", "bokeh")
        from bns.app.page import page  # noqa: PLC0415  # needs Panel
        from bns.app.results.page import results_page  # noqa: PLC0415
        from bns.app.web.server import PageServer  # noqa: PLC0415

        made = (lambda: results_page(shown)) if isinstance(shown, Study) else (lambda: page(shown))
        self._server = PageServer(made, port)  # Panel would show a partial, not call it
        self.address = self._server.address
        self._thread: threading.Thread | None = None

    def serve(self, browser: bool = True) -> None:
        """Answer until Ctrl-C or SIGTERM."""
        self._server.serve(browser)

    def start(self, browser: bool = True) -> Explorer:
        """Answer in the background, as notebooks need it."""
        self._thread = threading.Thread(target=self._server.serve, args=(browser,), name="bns-explore", daemon=True)
        self._thread.start()
        return self

    def stop(self) -> None:
        """End it."""
        self._server.stop()
        if self._thread is not None:
            self._thread.join(10)

    def __repr__(self) -> str:
        return f"<Explorer: {self.address}>"

    def _repr_html_(self) -> str:
        return f'<a href="{self.address}" target="_blank">bns explore</a>'


def explore(
    log: Log | DiagnoseResult | None = None, model: Given = FIRST_MODEL, *, port: int = 0, browser: bool = True
) -> Explorer:
    """Open the page and go on; ``.stop()`` ends it.

    Args:
        log: measurements, what `bns.diagnose` found, or the file of a saved session; or a folder of results, whose runs are shown
            then; without any, the page offers sample logs.
        model: `bns.Model`, or the name or file of one; a diagnosis brings its own.
        port: of this machine, by default any that is free.
        browser: open it in the user's browser.

    Raises:
        DataError, ModelError, StoreError: measurements, a model or results that cannot be used.
        MissingExtraError: the extra ``app`` is not installed.
    """
    return Explorer(shown_of(log, model), port).start(browser)


def shown_of(
    log: Log | DiagnoseResult | None, model: Given, data_words: Sequence[str] = (), model_words: tuple[str, ...] = ()
) -> Tabs | Study:
    """A store's runs, or what every tab begins with."""
    if isinstance(log, str | PathLike) and is_store(Path(log)):
        return Study(Path(log))
    return tabs_of(log, model, data_words, model_words)


def tabs_of(
    log: Log | DiagnoseResult | None, model: Given, data_words: Sequence[str] = (), model_words: tuple[str, ...] = ()
) -> Tabs:
    """What every tab begins with."""
    if isinstance(log, str | PathLike) and is_session(Path(log)):
        return Tabs(opened(Path(log)))
    first, kept = Tab(), None
    if isinstance(log, DiagnoseResult):
        kept, model, log = Background(log), log.ready.model, log.ready.log
    first.take(model, model_words or (_words(model),))
    files = files_of(log)
    for file in files:
        if is_store(Path(file)):
            raise DataError(f"{file} is a folder of results, which has a page of its own: give it alone.")
    if files:
        first.ask([Path(file) for file in files], data_words or tuple(map(str, files)))
    elif log is not None:
        first.open(log, data_words or _words(log))
    if kept is not None:
        first.diagnosis = kept
    return Tabs(first)


def _words(given: Any) -> str:
    return str(given) if isinstance(given, str | PathLike) else str(getattr(given, "name", "log.csv"))
