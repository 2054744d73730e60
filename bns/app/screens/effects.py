"""Switch effects on and watch the error fall: the heart of the page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import panel as pn

from bns.app.figures.errors import LadderFigure
from bns.app.figures.paths import PathFigure
from bns.app.html import error_list, message, note
from bns.app.jobs import Jobs
from bns.app.names import called
from bns.app.parts import WIDE, Problem, beside, button, drawn, heading, html, offer, on_change, row
from bns.app.screens.diagnosis import DiagnosisPart
from bns.app.screens.one_effect import GROUPS, OneEffect
from bns.app.screens.snapshots import SnapshotsPart
from bns.app.sliders import Slider
from bns.app.switches import Switches, Term
from bns.app.tab import Tab
from bns.app.workbench import Shown
from bns.diagnose.report.tables import ahead
from bns.errors import ModelError
from bns.physics.formula import ON, VARIABLES, formula_effect


@dataclass(frozen=True)
class Listed:
    """All effects; their switches by what they are about, each part with its heading; what stands above them."""

    effects: dict[str, OneEffect]
    groups: list[tuple[Any, list[OneEffect]]]
    above: list[Any]


class EffectsScreen:
    """Switches to the left, the list of errors and the paths to the right."""

    def __init__(self, tab: Tab, jobs: Jobs) -> None:
        self._tab, self._jobs = tab, jobs
        self._shown: Shown | None = None
        self._problem, self._formula_problem = Problem(), Problem()
        self._effects: dict[str, OneEffect] = {}
        self._switches = pn.Column(**WIDE)
        self._listed = Listed({}, [], [])
        hint = "words, such as: slower in turns"
        self._sought = pn.widgets.TextInput(**called("Find an effect"), placeholder=hint, width=300, visible=False)
        self._how_many = html()
        self._errors, self._warnings = html(), html()
        self._ladder = LadderFigure()
        self._before = PathFigure("as given")
        self._after = PathFigure("now", self._before)
        self._horizon = pn.widgets.Select(**called("Error how far ahead"), options={ahead("1s"): "1s"}, width=160)
        self._trial = pn.widgets.Select(**called("Trial"), options=[], width=240)
        self._time = Slider(**called("Time in the trial (s)"), start=0, end=1, step=0.02, **WIDE)
        self._diagnosis = DiagnosisPart(tab, jobs, self._learned, self._switch_to)
        self._snapshots = SnapshotsPart(tab, jobs, self._go_to, lambda: str(self._horizon.value))
        self._name = pn.widgets.TextInput(**called("Name"), value="mine", width=110)
        self._term = pn.widgets.TextInput(**called("Formula"), placeholder="k * v * abs(w)", width=220)
        self._on = pn.widgets.Select(**called("Added to"), options=list(ON), width=90)
        self._add_term = button("Add the formula", self._take_term)
        self._undo, self._redo = button("Undo", self._go_back), button("Redo", self._go_forward)
        self._fit = button("Fit all numbers", self._fit_all)
        self._watch()
        self.view = self._laid_out()
        self._bench: object = None
        self._listing: object = None

    def enter(self) -> None:
        """Drawn again: another log or model brings other effects."""
        bench = self._tab.bench
        if bench is None:
            self._problem.show(self._tab.why_no_bench or "Open a log first, on the Data screen.")
            return
        if bench.of_networks:
            text = f"{self._tab.networks} holds networks, which have no effects; they are compared on “Where it fails”."
            self._problem.show(text)
        self._body.visible = not bench.of_networks
        if bench.of_networks:
            return
        if bench is not self._bench:
            self._bench = bench
            self._effects, self._switches.objects, self._sought.visible = {}, [], False
            self._formula.visible = bench.on_wheels
            names = list(bench.ready.predictor.tracks.names)
            offer(self._trial, dict(zip(names, range(len(names)), strict=True)))
            self._horizon.options = {ahead(h): h for h in bench.horizons}
            self._horizon.value = bench.ready.predictor.near
        self._problem.show("")
        self.update()
        self._snapshots.enter()
        self._diagnosis.enter()

    def update(self) -> None:
        """What is on is fitted, beside the page, and shown."""
        bench, state = self._tab.bench, self._tab.now
        if bench is None:
            return
        self._sync_switches(state)
        if state.by_hand:  # nothing is fitted: quick enough to be done at once
            self._show(bench.shown(state))
            return
        text = f"fitting {', '.join(state.on)}" if state.on else "judging the model as given"
        self._jobs.run(text, lambda: bench.shown(state), self._show_if_current, self._failed)

    def _list_late(self) -> None:
        """The list of effects has many parts: the pictures come before it."""
        if self._effects or self._listing is self._bench:
            return
        self._listing = bench = self._bench

        def listed(made: Listed) -> None:
            if bench is self._bench and not self._effects:
                self._lay_switches(made)
                self._refresh_effects()
                self._sync_switches(self._tab.now)

        def failed(text: str) -> None:
            self._listing = None  # the next picture asks again
            self._problem.show(text)

        self._jobs.run("listing the effects", self._groups, listed, failed, later=True)

    def move(self, effect: str, parameter: str, value: float) -> None:
        """A number was moved by hand."""
        self._tab.history.to(self._tab.now.moved(effect, parameter, value))
        self.update()

    def switch(self, name: str, on: bool) -> None:
        """An effect was switched on or off."""
        if on == (name in self._tab.now.on):
            return
        term = next((t for t in self._diagnosis.terms if t.name == name and on), None)
        state = self._tab.now
        self._tab.history.to(state.switched(name, on) if term is None else state.with_term(term))
        self.update()

    def _switch_to(self, names: tuple[str, ...], terms: tuple[Term, ...], off: tuple[str, ...]) -> None:
        state = self._tab.now
        for name in off:
            state = state.switched(name, False) if name in state.on else state
        for name in names:
            state = state if name in state.on else state.switched(name, True)
        for term in terms:
            state = state.with_term(term)
        self._tab.history.to(state)
        self._after_walk()

    def _go_to(self, state: Switches) -> None:
        self._tab.history.to(state)
        self._after_walk()

    def _show_if_current(self, shown: Shown) -> None:
        if shown.switches.on == self._tab.now.on and not self._tab.now.by_hand:
            self._show(shown)

    def _failed(self, text: str) -> None:
        self._problem.show(text)
        self._list_late()
        self._go_back()

    def _show(self, shown: Shown) -> None:
        self._shown = shown
        self._problem.show("")
        horizon = shown.errors.horizons[self._horizon.value]
        self._errors.object = error_list(horizon) + note(self._tab.bench.thinned if self._tab.bench else "")
        self._warnings.object = "".join(message(w) for w in shown.warnings)
        self._ladder.fill(horizon)
        self._show_paths()
        self._refresh_effects()
        self._sync_switches(self._tab.now)
        self._list_late()

    def _show_horizon(self) -> None:
        if self._shown is not None:
            self._show(self._shown)
            self._snapshots.enter()

    def _show_paths(self) -> None:
        bench, shown = self._tab.bench, self._shown
        if bench is None or shown is None or self._trial.value is None:
            return
        number = self._trial.value
        t_s, measured = bench.measured(number)
        trial = f"Trial {bench.ready.predictor.tracks.names[number]}"
        for picture, steps, name in (
            (self._before, shown.steps[0], "as given"),
            (self._after, shown.steps[-1], shown.names[-1] if len(shown.names) > 1 else "now: nothing added"),
        ):
            picture.fill(f"{trial}: {name}", t_s, measured, bench.path(steps, number))
        if len(t_s) and t_s[-1] > 0:
            self._time.end = float(t_s[-1])
        self._show_time()

    def _show_time(self) -> None:
        for picture in (self._before, self._after):
            picture.at(min(self._time.value, self._time.end))

    def _list_effects(self) -> None:
        self._lay_switches(self._groups())

    def _lay_switches(self, made: Listed) -> None:
        self._listed, self._effects = made, made.effects
        self._sought.visible = True
        self._find()

    def _find(self) -> None:
        """Only effects that hold the words sought, and those that are on."""
        words, on = self._sought.value_input.lower().split(), self._tab.now.on
        shown = [
            (title, [e for e in inside if e.effect.name in on or e.holds(words)]) for title, inside in self._listed.groups
        ]
        parts = [part for title, inside in shown if inside for part in (title, *(each.view for each in inside))]
        self._switches.objects = [*self._listed.above, *parts]
        holding = sum(each.holds(words) for _, inside in self._listed.groups for each in inside)
        whole = sum(len(inside) for _, inside in self._listed.groups)
        self._how_many.object = note(f"{holding} of {whole} effects mention {' and '.join(words)}") if words else ""

    def _groups(self) -> Listed:
        """Those that are there already stay the same."""
        bench = self._tab.bench
        assert bench is not None
        mine = {t.name: t for t in self._tab.now.terms}
        found = {t.name: t for t in self._diagnosis.terms if t.name not in mine}
        terms = {name: bench.term(t) for name, t in {**mine, **found}.items()}
        named = {name: e for name, e in {**bench.catalogue, **terms}.items() if name not in found}
        effects = dict(self._effects)
        for name, effect in {**bench.catalogue, **terms}.items():
            if name not in effects or effects[name].effect is not effect:
                words = self._diagnosis.term_in_words(name)
                said = f"{name}: add this term: {words}" if words else ""
                effects[name] = OneEffect(effect, self.switch, self.move, said)
        groups = [(heading("What no effect explains"), [effects[name] for name in found])]
        for stage, title in GROUPS.items():
            groups.append((heading(title), [effects[n] for n, e in named.items() if e.stage == stage]))
        present = ", ".join(a.effect.name for a in bench.ready.model.effects)
        there = [html(f"<p>In the model already: {present}.</p>")] if present else []
        return Listed(effects, groups, there)

    def _refresh_effects(self) -> None:
        if self._shown is not None:
            for each in self._effects.values():
                each.refresh(
                    self._shown, self._diagnosis.alone(each.effect.name), self._diagnosis.ties(each.effect.name)
                )

    def _learned(self) -> None:
        """The diagnosis knows more: what effects earn, and terms of its own."""
        if self._effects and self._diagnosis.terms:
            self._list_effects()
        self._refresh_effects()

    def _sync_switches(self, state: Switches) -> None:
        for name, each in self._effects.items():
            each.set_on(name in state.on)
        history = self._tab.history
        self._undo.disabled, self._redo.disabled = history.at == 0, history.at == len(history.states) - 1
        self._fit.disabled = not state.by_hand

    def _go_back(self) -> None:
        self._tab.history.undo()
        self._after_walk()

    def _go_forward(self) -> None:
        self._tab.history.redo()
        self._after_walk()

    def _after_walk(self) -> None:
        if self._effects and (self._tab.now.terms or self._diagnosis.terms):
            self._list_effects()
        self.update()

    def _fit_all(self) -> None:
        self._tab.history.to(self._tab.now.fitted())
        self.update()

    def _take_term(self) -> None:
        bench, name = self._tab.bench, self._name.value_input or self._name.value
        if bench is None or not self._check_term():
            return
        if name in bench.catalogue or any(a.effect.name == name for a in bench.ready.model.effects):
            self._formula_problem.show(f"{name} is the name of a listed effect; give the formula another one.")
            return
        self._tab.history.to(self._tab.now.with_term(Term(name, self._term.value_input, self._on.value)))
        self._list_effects()
        self.update()

    def _check_term(self) -> bool:
        """Live: the library's own message, or nothing."""
        text, bench = self._term.value_input, self._tab.bench
        try:
            if text:
                formula_effect(self._name.value_input or "mine", text, self._on.value, bench.columns if bench else ())
        except ModelError as fault:
            self._formula_problem.show(str(fault))
            return False
        self._formula_problem.show("")
        return bool(text)

    def _watch(self) -> None:
        for widget, act in (
            (self._horizon, self._show_horizon),
            (self._trial, self._show_paths),
            (self._time, self._show_time),
            (self._on, self._check_term),
        ):
            on_change(widget, act)
        on_change(self._term, self._check_term, "value_input")
        on_change(self._sought, self._find, "value_input")

    def _laid_out(self) -> Any:
        variables = "; ".join(f"{name}: {text}" for name, text in VARIABLES.items())
        self._formula = pn.Column(
            heading("A formula of your own"),
            row(self._name, self._term, self._on, self._add_term, align_items="end"),
            self._formula_problem.view,
            html(f"<details><summary>names that it may contain</summary>{variables}</details>"),
            **WIDE,
        )
        left = pn.Column(self._sought, self._how_many, self._switches, self._formula, **WIDE)
        right = pn.Column(
            row(self._undo, self._redo, self._fit),
            row(self._horizon, self._trial),
            self._errors,
            drawn(self._ladder.figure),
            self._warnings,
            beside(drawn(self._before.figure), drawn(self._after.figure), least=280),
            self._time,
            self._snapshots.view,
            **WIDE,
        )
        self._body = pn.Column(self._diagnosis.view, beside(left, right, least=330, first=right, in_view=True), **WIDE)
        return pn.Column(self._problem.view, self._body, **WIDE)
