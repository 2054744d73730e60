"""Sliders that answer at once and that a screen reader can name: a number in a box, and the same number on a slider below."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

import panel as pn

from bns.app.names import called
from bns.app.parts import WIDE, on_change

_UNTITLED = ".bk-slider-title { display: none; }"
_IN_A_LINE = ".bk-input-group { flex-direction: row; align-items: center; gap: 8px; } label { white-space: nowrap; }"
_DIGITS = "0.00000"
NAMES = """
for (const kind of ["Slider", "RangeSlider", "DateSlider"]) {
  const view = Bokeh.Models.get(kind).prototype.default_view
  const render = view.prototype.render
  view.prototype.render = function() {
    render.call(this)
    const handles = [...this.shadow_el.querySelectorAll(".noUi-handle")]
    for (const handle of handles) handle.setAttribute("aria-label", this.model.title)
    const say = (values) => handles.forEach((handle, i) => handle.setAttribute("aria-valuetext", this.pretty(values[i])))
    this._noUiSlider.off("update.said")
    this._noUiSlider.on("update.said", (_texts, _handle, values) => queueMicrotask(() => say(values)))
  }
}
const box = Bokeh.Models.get("Spinner").prototype.default_view.prototype
const rendered = box.render
box.render = function() {
  rendered.call(this)
  for (const way of ["up", "down"]) {
    this.shadow_el.querySelector(`.bk-spin-btn-${way}`)?.setAttribute("aria-label", `a step ${way}`)
  }
}
"""
"""Script: Bokeh gives the handle of a slider the role of one, no name, and two digits of its value, whatever the format; and the
arrows beside a number no name."""


class Slider(pn.widgets.FloatSlider):
    """Panel waits 50 ms for further changes before it tells of one; those that come while the page works are one anyway."""

    _debounce: ClassVar[int] = 1


class NumberSlider:
    """``moved`` is told a number that the user gave, in the box, called ``name``, or by the slider, called ``short``."""

    def __init__(
        self,
        name: str,
        short: str,
        value: float,
        within: tuple[float, float],
        steps: int,
        bounds: tuple[float | None, float | None],
        moved: Callable[[float], object],
    ) -> None:
        start, end = within
        step = (end - start) / steps
        self._moved, self._quiet = moved, False
        self._box = pn.widgets.FloatInput(
            **called(name), value=value, step=step, start=bounds[0], end=bounds[1], format=_DIGITS, width=300, margin=0,
            stylesheets=[_IN_A_LINE],
        )  # fmt: skip
        self._slider = Slider(
            **called(short), value=value, start=start, end=end, step=step, show_value=False, format=_DIGITS, margin=(0, 0, 5, 0),
            stylesheets=[_UNTITLED], **WIDE,
        )  # fmt: skip
        for widget in (self._box, self._slider):
            on_change(widget, partial(self._moved_to, widget))
        self.view: Any = pn.Column(self._box, self._slider, margin=(0, 8, 4, 30), **WIDE)

    def show(self, value: float) -> None:
        """A number, without telling anybody; the slider reaches as far as it must."""
        self._quiet = True
        self._slider.param.update(
            start=min(self._slider.start, value), end=max(self._slider.end, value), value=value
        )
        self._box.value = value
        self._quiet = False

    def _moved_to(self, widget: Any) -> None:
        value: float | None = widget.value
        if not self._quiet and value is not None:
            self.show(float(value))
            self._moved(float(value))
