"""Work that takes longer than a click may: done beside the page, one after the other, its end shown when the page is free."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

from bns.app.parts import together
from bns.errors import BnsError

T = TypeVar("T")


class Jobs:
    """``document``: of Bokeh; ``say``: takes what is being done ("" for nothing); ``changed``: told by a screen that log or model
    are others now, for the user may have gone to another screen meanwhile. Nothing is shown before `begin` says that the browser
    has the page: Panel loses some of what changes while it is on its way."""

    def __init__(self, document: Any, say: Callable[[str], None], changed: Callable[[object], None]) -> None:
        self._document, self._say, self._waiting = document, say, list[str]()
        self._begun, self._early = False, list[Callable[[], None]]()
        self.changed = changed
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="bns-page")

    def run(self, text: str, work: Callable[[], T], done: Callable[[T], None], failed: Callable[[str], None]) -> None:
        """``work`` elsewhere, then ``done`` with what it gave, or ``failed`` with the library's message."""
        self._waiting.append(text)
        self._tell()

        def ended(future: Future[T]) -> None:
            def show() -> None:
                if not self._begun:
                    self._early.append(show)
                    return
                with together():
                    self._waiting.pop(0)
                    self._tell()
                    try:
                        result = future.result()
                    except BnsError as fault:
                        failed(str(fault))
                    except Exception as fault:
                        failed(f"Internal error: {type(fault).__name__}: {fault}")
                        raise
                    else:
                        done(result)

            self._document.add_next_tick_callback(show)

        self._pool.submit(work).add_done_callback(ended)

    def begin(self) -> None:
        """The browser has the page: from now on what is done is shown."""

        def show() -> None:
            self._begun = True
            with together():
                self._tell()
                for one in self._early:
                    one()
            self._early.clear()

        self._document.add_next_tick_callback(show)

    def _tell(self) -> None:
        if self._begun:
            self._say(self._waiting[0] if self._waiting else "")

    def end(self) -> None:
        """Nothing more is begun."""
        self._pool.shutdown(wait=False, cancel_futures=True)
