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
    are others now, for the user may have gone to another screen meanwhile."""

    def __init__(self, document: Any, say: Callable[[str], None], changed: Callable[[object], None]) -> None:
        self._document, self._say, self._waiting = document, say, 0
        self.changed = changed
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="bns-page")

    def run(self, text: str, work: Callable[[], T], done: Callable[[T], None], failed: Callable[[str], None]) -> None:
        """``work`` elsewhere, then ``done`` with what it gave, or ``failed`` with the library's message."""
        self._waiting += 1
        self._say(text)

        def ended(future: Future[T]) -> None:
            def show() -> None:
                with together():
                    self._waiting -= 1
                    self._say("" if self._waiting == 0 else text)
                    try:
                        result = future.result()
                    except BnsError as fault:
                        failed(str(fault))
                    except Exception as fault:
                        failed(f"This should not have happened: {type(fault).__name__}: {fault}")
                        raise
                    else:
                        done(result)

            self._document.add_next_tick_callback(show)

        self._pool.submit(work).add_done_callback(ended)

    def end(self) -> None:
        """Nothing more is begun."""
        self._pool.shutdown(wait=False, cancel_futures=True)
