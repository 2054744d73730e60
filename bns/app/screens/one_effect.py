"""One effect: its switch, what it is, its numbers with a slider each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import panel as pn

from bns.app.html import effect_text
from bns.app.parts import WIDE, html
from bns.app.workbench import Shown
from bns.physics.effect import Effect, Parameter

_STEPS = 400
_WRAPPED = "label { white-space: normal; overflow-wrap: anywhere; }"


class OneEffect:
    """``switch(name, on)`` and ``move(name, parameter, value)`` are told what the user does; ``said``: its label."""

    def __init__(
        self,
        effect: Effect,
        switch: Callable[[str, bool], None],
        move: Callable[[str, str, float], None],
        said: str = "",
    ) -> None:
        self.effect, self._move, self._quiet = effect, move, False
        said = said or f"{effect.name}: {effect.in_words}"
        # a group of one: Bokeh's single checkbox has no label that a screen reader or a click would find
        self._box = pn.widgets.CheckBoxGroup(
            options={said: effect.name}, margin=(6, 8, 0, 8), stylesheets=[_WRAPPED], **WIDE
        )
        self._box.param.watch(lambda event: None if self._quiet else switch(effect.name, bool(event.new)), "value")
        self._text = html(effect_text(effect, (), {}, ""), margin=(0, 8, 4, 30))
        self._sliders: dict[str, Any] = {}
        self.view = pn.Column(self._box, self._text, **WIDE)

    def set_on(self, on: bool) -> None:
        """The switch as the state has it, without telling anybody."""
        if bool(self._box.value) != on:
            self._quiet = True
            self._box.value = [self.effect.name] if on else []
            self._quiet = False

    def refresh(self, shown: Shown, alone: str, ties: Sequence[str]) -> None:
        """Fitted numbers, badges, and the sliders where the model has them."""
        name = self.effect.name
        badges = [*shown.badges.get(name, ()), *(f"cannot be told apart from {other}" for other in ties)]
        text = effect_text(self.effect, badges, shown.numbers.get(name, {}), alone)
        if self._text.object != text:
            self._text.object = text
        values = next((a.by_name for a in shown.model.effects if a.effect.name == name), None)
        if values is None:
            if self._sliders:
                self.view.objects, self._sliders = [self._box, self._text], {}
            return
        if not self._sliders:
            self._sliders = {p.name: self._slider(p, values[p.name]) for p in self.effect.parameters}
            self.view.objects = [self._box, self._text, *self._sliders.values()]
        self._quiet = True
        for parameter, slider in self._sliders.items():
            slider.start, slider.end = min(slider.start, values[parameter]), max(slider.end, values[parameter])
            if slider.value != values[parameter]:
                slider.value = values[parameter]
        self._quiet = False

    def _slider(self, p: Parameter, value: float) -> Any:
        low, high = (v for v in p.plausible)
        start, end = (float(v) for v in (min(low, value), max(high, value)) if np.isfinite(v))
        made = pn.widgets.EditableFloatSlider(
            name=f"{p.name} ({p.unit}), by hand",
            start=start,
            end=end,
            step=(end - start) / _STEPS,
            value=value,
            fixed_start=p.low,
            fixed_end=p.high,
            format="0.00000",
            margin=(0, 8, 4, 30),
            **WIDE,
        )
        made.param.watch(lambda event: self._moved(p.name, event.new), "value")
        return made

    def _moved(self, parameter: str, value: float) -> None:
        if not self._quiet and value is not None:
            self._move(self.effect.name, parameter, float(value))
