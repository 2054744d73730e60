"""One effect: its switch, what it is, its numbers with a slider each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np
import panel as pn

from bns.app.html import effect_text
from bns.app.parts import WIDE, html, on_change
from bns.app.sliders import NumberSlider
from bns.app.workbench import Shown
from bns.physics.effect import Effect, Parameter

GROUPS = {
    "wheel": "Wheels",
    "body": "Body",
    "mechanics": "Servos, joints and floor",
    "world": "Floor",
    "clock": "Clock",
    "measure": "Camera",
    "sight": "Camera and markers",
}
"""Stage of an effect -> what it is about, for people."""
_STEPS = 400
_WRAPPED = "label { white-space: normal; overflow-wrap: anywhere; }"


class _Box(pn.widgets.CheckBoxGroup):
    """One click is one change: nothing is waited for."""

    _debounce: ClassVar[int] = 1


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
        self._box = _Box(options={said: effect.name}, margin=(6, 8, 0, 8), stylesheets=[_WRAPPED], **WIDE)
        on_change(self._box, lambda: None if self._quiet else switch(effect.name, bool(self._box.value)))
        self._text = html(effect_text(effect, (), {}, ""), margin=(0, 8, 4, 30))
        self._sliders: dict[str, NumberSlider] = {}
        self.view = pn.Column(self._box, self._text, **WIDE)

    def holds(self, words: Sequence[str]) -> bool:
        """Whether each of the words, in lower case, is in what is said of the effect."""
        effect = self.effect
        numbers = " ".join(f"{p.name} {p.unit}" for p in effect.parameters)
        said = f"{effect.name} {effect.in_words} {effect.equation} {effect.residuals} {numbers} {GROUPS.get(effect.stage, '')}"
        return all(word in said.lower() for word in words)

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
            self.view.objects = [self._box, self._text, *(slider.view for slider in self._sliders.values())]
        for parameter, slider in self._sliders.items():
            slider.show(values[parameter])

    def _slider(self, p: Parameter, value: float) -> NumberSlider:
        low, high = p.plausible
        start, end = (float(v) for v in (min(low, value), max(high, value)) if np.isfinite(v))
        return NumberSlider(
            f"{p.name}, by hand" if p.unit == "1" else f"{p.name} ({p.unit}), by hand",
            p.name if p.unit == "1" else f"{p.name}, {p.unit}",
            value,
            (start, end),
            _STEPS,
            (p.low, p.high),
            lambda moved: self._move(self.effect.name, p.name, moved),
        )
