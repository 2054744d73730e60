"""A button that begins work beside the page, one that stops it, and what it says meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any, Generic, TypeVar

import panel as pn

from bns.app.background import Background
from bns.app.html import message
from bns.app.parts import button, html, row, together

T = TypeVar("T")
EVERY_MS = 500


class Working(Generic[T]):
    """``begin`` starts the work on what `work` gives; ``done`` is called with every result, once it is shown, ``meanwhile``
    whenever it was looked at while it went on."""

    def __init__(
        self,
        name: str,
        begin: Callable[[], None],
        work: Callable[[], Background[T]],
        done: Callable[[T], None],
        meanwhile: Callable[[], None] = lambda: None,
    ) -> None:
        self._work, self._done, self._meanwhile = work, done, meanwhile
        self._clock: Any = None
        self.said = html()
        self._begin = button(name, lambda: self._start(begin), "primary")
        self._stop = button("Stop", self._end)
        self.buttons = row(self._begin, self._stop)

    def enter(self) -> None:
        """As the work stands: not begun, going on, or done."""
        if self._work().at_work and self._clock is None:
            self._clock = pn.state.add_periodic_callback(self._look_again, period=EVERY_MS)
        self._look()

    def fail(self, text: str) -> None:
        """Something that followed the work did not succeed: the message stands below what is said."""
        self.said.object += message(text)

    def _start(self, begin: Callable[[], None]) -> None:
        begin()
        self.enter()

    def _end(self) -> None:
        self._work().stop()
        self._look()

    def _look_again(self) -> None:
        with together():
            self._look()

    def _look(self) -> None:
        work = self._work()
        self._begin.disabled, self._stop.disabled = work.at_work, not work.at_work
        if work.at_work:
            self.said.object = f"<p>{escape(work.progress)}</p>"
            self._meanwhile()
            return
        if self._clock is not None:
            self._clock.stop()
            self._clock = None
        self.said.object = message(work.why)
        if work.result is not None:
            self._done(work.result)
