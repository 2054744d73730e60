"""Work that takes longer than a click may: done beside the page, one after the other, its end shown when the page is free."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, TypeVar

from panel.io.state import set_curdoc, state

from bns.app.parts import together
from bns.errors import BnsError

T = TypeVar("T")
LONGEST_S = 2.0
"""The page is held back for its first picture so long; what takes longer comes into a page that says what it waits for."""


class Jobs:
    """``document``: of Bokeh; ``say``: takes what is being done ("" for nothing); ``changed``: told by a screen that log or model
    are others now, for the user may have gone to another screen meanwhile. Nothing is shown before `begin` says that the browser
    has the page: Panel loses some of what changes while it is on its way."""

    def __init__(self, document: Any, say: Callable[[str], None], changed: Callable[[object], None]) -> None:
        self._document, self._say, self._waiting = document, say, list[str]()
        self._begun, self._early = False, list[Callable[[], None]]()
        self._making: int | None = None
        self._loop, self._ended = asyncio.get_running_loop(), False
        self.changed = changed
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="bns-page")

    async def first(self, make: Callable[[], T], add: Callable[[T], None]) -> None:
        """``make`` what the user sees first while the browser reads its files, and ``add`` it to the page.

        Bokeh hands out no page while this is awaited, as its own callback: the browser gets one that is whole, not an empty one
        and then its parts, which it would lay out anew. Where the browser was quicker, it gets the parts when it has the page.
        """
        unasked = self._unasked()

        def made() -> T:
            self._making = threading.get_ident()
            try:
                with set_curdoc(self._document):
                    return make()
            finally:
                self._making = None

        work = self._pool.submit(made)
        waited = asyncio.wrap_future(work)
        if unasked:
            await asyncio.wait({waited}, timeout=LONGEST_S)
        if unasked and waited.done():
            with set_curdoc(self._document), _changed_at_once(self._document):
                add(waited.result())
        else:
            self.run("drawing the page", work.result, add, self._say)

    def run(
        self,
        text: str,
        work: Callable[[], T],
        done: Callable[[T], None],
        failed: Callable[[str], None],
        later: bool = False,
    ) -> None:
        """``work`` elsewhere, then ``done`` with what it gave, or ``failed`` with the library's message.

        What `first` makes does it at once, unless it may come ``later`` than the first picture.
        """
        if self._making == threading.get_ident() and not later:
            _end(work, done, failed)
            return
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
                    _end(future.result, done, failed)

            def ask() -> None:
                if not self._ended:
                    self._document.add_next_tick_callback(show)

            if not self._loop.is_closed():
                self._loop.call_soon_threadsafe(ask)

        def on_the_page() -> T:
            with set_curdoc(self._document):  # else Panel takes the page that another thread is busy with, which may be none
                return work()

        self._pool.submit(on_the_page).add_done_callback(ended)

    def begin(self) -> None:
        """The browser has the page: from now on what is done is shown."""

        def show() -> None:
            self._begun = True
            with together():
                self._tell()
            for one in self._early:  # a message each: the second may change what the browser gets with the first
                one()
            self._early.clear()

        self._document.add_next_tick_callback(show)

    def _unasked(self) -> bool:
        """Has the browser not asked for the page yet?"""
        context = getattr(self._document, "session_context", None)
        return context is not None and context.session is not None and context.session.connection_count == 0

    def _tell(self) -> None:
        if self._begun:
            self._say(self._waiting[0] if self._waiting else "")

    def end(self) -> None:
        """Nothing more is begun or shown."""
        self._ended = True
        self._pool.shutdown(wait=False, cancel_futures=True)


@contextmanager
def _changed_at_once(document: Any) -> Iterator[None]:
    """Panel puts off what changes before a browser is there, until after the page went out; here nothing goes out meanwhile."""
    connected: Any = state._connected
    was_there, connected[document] = connected.get(document, False), True
    try:
        yield
    finally:
        connected[document] = was_there


def _end(work: Callable[[], T], done: Callable[[T], None], failed: Callable[[str], None]) -> None:
    """``done`` with what the work gave, or ``failed`` with why it gave nothing."""
    try:
        result = work()
    except BnsError as fault:
        failed(str(fault))
    except Exception as fault:
        failed(f"Internal error: {type(fault).__name__}: {fault}")
        raise
    else:
        done(result)
