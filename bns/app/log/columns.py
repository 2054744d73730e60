"""Menus for what a log's columns mean, with the first paths as they would be read; the mapping itself under Advanced."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

import panel as pn

from bns.app.figures.paths import LogFigure
from bns.app.log import roles
from bns.app.log.preview import preview
from bns.app.log.roles import BY_COLUMN, COMMANDED, CUTS, ROLES, RUNNING, WHOLE, Mapped, Menus
from bns.app.names import call, called, text_on
from bns.app.parts import WIDE, Problem, beside, button, download, drawn, heading, html, on_change, row
from bns.app.tab import mapping_of
from bns.diagnose.data.guess.mapping import METRES, blanks_of
from bns.errors import DataError

NONE = "(none)"
_SECONDS = 1.0


class ColumnsPart:
    """``taken``: called with the mapping when the user wants the log read so."""

    def __init__(self, taken: Callable[[Mapped], None]) -> None:
        self._menus: Menus | None = None
        self._mapping: Mapped = {"columns": {}}
        self._quiet, self._name, self._folder = False, "log", Path()
        self._problem, self._said, self._remarks, self._save = Problem(), html(), html(), html()
        self._picture = LogFigure("The first paths, as this mapping reads them", height=300)
        self._commanded = pn.widgets.Select(**called("Commanded are"), options=list(COMMANDED), width=230)
        self._columns = {role: pn.widgets.Select(**called(said), options={}, width=230) for role, said in ROLES.items()}
        self._units = {
            role: pn.widgets.Select(**called(f"{said}: unit"), options=[], width=200)
            for role, said in ROLES.items()
            if role != "trial"
        }
        self._running = pn.widgets.Select(**called("The heading runs"), options=list(RUNNING), width=230)
        self._scale = pn.widgets.FloatInput(**called("Radius of the wheels (m)"), value=None, width=180)
        self._wheelbase = pn.widgets.FloatInput(**called("Wheelbase of the controller (m)"), value=None, width=210)
        self._trials = pn.widgets.Select(**called("Trials"), options=[BY_COLUMN, *CUTS.values(), WHOLE], width=230)
        self._seconds = pn.widgets.FloatInput(**called("Seconds"), value=_SECONDS, start=0.001, step=1, width=110)
        self._text = pn.widgets.TextAreaInput(**called("The mapping (FILE.import.yaml)"), height=230, **WIDE)
        self._advanced = pn.widgets.Toggle(**called("Advanced: the mapping as YAML"), value=False)
        self._take = button("Read it with this", lambda: taken(self._mapping), "primary")
        self._watch()
        self.view = self._laid_out()
        self.view.visible = False

    def show(self, menus: Menus, mapping: Mapping[str, Any] | None, name: str, folder: Path) -> None:
        """Open for files that were read; ``mapping``: how they are read now, None: as guessed."""
        self._menus, self._name, self._folder = menus, name, folder
        remarks = menus.guess.said if mapping is None else ()  # blanks are asked for beside their fields
        self._remarks.object = "".join(f"<p>{escape(remark)}</p>" for remark in remarks)
        self._take_over(dict(menus.guess.mapping if mapping is None else mapping))
        self.view.visible = True

    def hide(self) -> None:
        """The log is read."""
        self.view.visible = False

    def _take_over(self, mapping: Mapped, text: str | None = None) -> None:
        """Another mapping: menus, text and preview follow it."""
        self._mapping, self._quiet = mapping, True
        self._text.value = roles.written(mapping) if text is None else text
        self._fill()
        self._quiet = False
        self._preview()

    def _fill(self) -> None:
        menus, mapping = self._menus, self._mapping
        assert menus is not None
        told = roles.commanded(mapping)
        self._commanded.value = told
        hidden = {role for how, pair in COMMANDED.items() if how != told for role in pair}
        for role, menu in self._columns.items():
            options = {NONE: None, **menus.columns(role)}
            picked = roles.picked(mapping, role)
            if picked is not None and picked.place not in options.values():
                options[f"{picked.place[1]} (no such column)"] = picked.place
            menu.options, menu.value = options, picked.place if picked else None
            menu.visible = role not in hidden
            call(menu, roles.label(mapping, role))
            if role in self._units:
                self._fill_unit(role, picked, menu.visible)
        self._fill_numbers(told)

    def _fill_unit(self, role: str, picked: roles.Picked | None, visible: bool) -> None:
        menu = self._units[role]
        menu.visible = visible and picked is not None
        call(menu, f"{roles.label(self._mapping, role)}: unit")
        if picked is not None:
            options = roles.units(role, picked.place[1])
            menu.options = options if picked.unit in options else [*options, picked.unit]
            menu.value = picked.unit

    def _fill_numbers(self, told: str) -> None:
        mapping = self._mapping
        units = {menu.value for role, menu in self._units.items() if menu.visible}
        counted = roles.COUNTED in units
        self._scale.visible = counted or roles.TURNS in units
        call(self._scale, "Distance per encoder count (m)" if counted else roles.name_of_scale(mapping))
        self._scale.value = roles.wheel_scale(mapping)
        self._wheelbase.visible = told == roles.BODY
        base = mapping.get("wheelbase_m")
        self._wheelbase.value = float(base) if isinstance(base, int | float) else None
        said = roles.running(mapping)
        self._running.options = list(RUNNING) if said else [*RUNNING, "as the mapping says"]
        self._running.value = said or "as the mapping says"
        self._running.visible = roles.picked(mapping, "heading_rad") is not None
        key, seconds = next(iter((mapping.get("trials") or {}).items()), ("", _SECONDS))
        by_column = roles.picked(mapping, "trial") is not None
        self._trials.value = CUTS.get(key) or (BY_COLUMN if by_column else WHOLE)
        self._seconds.visible, self._seconds.value = bool(key), float(seconds)
        self._columns["trial"].visible = self._trials.value == BY_COLUMN

    def _preview(self) -> None:
        assert self._menus is not None
        found = preview(self._menus.tables, self._mapping, self._folder)
        paths = [(name, "", path) for name, path in zip(found.names, found.paths, strict=True)]
        self._picture.fill(paths, {"x": [], "y": [], "text": []})
        self._problem.show(self._to_fill_in() or found.problem)
        self._said.object = f"<p id='bns-preview'>{escape(found.said)}</p>" if found else ""
        name = f"{self._name}.import.yaml"
        text = roles.written(self._mapping).encode()
        self._save.object = download(f"Save {name}", name, text, "text/yaml") if found else ""

    def _to_fill_in(self) -> str:
        """Which numbers the units and commands need that are not there yet: in which field, in which line, what to measure."""
        blanks = {b.where.split()[0]: b for b in blanks_of(self._mapping, self._menus.tables if self._menus else {})}
        fields = {"scale": self._scale, "wheelbase_m": self._wheelbase}
        empty = [(text_on(field), blanks.get(key)) for key, field in fields.items() if field.visible and not field.value]
        said = [name if b is None else f"{name} ({b.where} of the mapping): {b.what}" for name, b in empty]
        return f"Fill in the field {'; and the field '.join(said)}." if said else ""

    def _pick(self, role: str) -> None:
        assert self._menus is not None
        self._take_over(self._menus.with_column(self._mapping, role, self._columns[role].value))

    def _pick_unit(self, role: str) -> None:
        self._take_over(roles.with_unit(self._mapping, role, self._units[role].value))

    def _tell(self) -> None:
        """Commands are told the other way: what the guess knows of it, else nothing yet."""
        assert self._menus is not None
        mapping = self._mapping
        for how, pair in COMMANDED.items():
            for role in pair:
                guess = roles.picked(self._menus.guess.mapping, role) if how == self._commanded.value else None
                mapping = self._menus.with_column(mapping, role, guess.place if guess else None)
        if self._commanded.value == roles.BODY:
            self._begin_body(mapping)
        else:
            mapping.pop("wheelbase_m", None)
        self._take_over(mapping)

    def _begin_body(self, mapping: Mapped) -> None:
        """Menus tell body commands from those of the wheels by an entry that is there: the first column stands for it."""
        assert self._menus is not None
        if roles.commanded(mapping) != roles.BODY:
            first = next(iter(self._menus.columns(roles.FORWARD).values()))
            mapping["columns"][roles.FORWARD] = {"from": first[1]}
        mapping.setdefault("wheelbase_m", METRES)

    def _cut(self) -> None:
        assert self._menus is not None
        said = self._trials.value
        key = next((key for key, name in CUTS.items() if name == said), "")
        if key:
            mapping = roles.with_cut(self._mapping, key, float(self._seconds.value or _SECONDS))
        else:
            mapping = roles.without_role(self._mapping, "trial")
            mapping.pop("trials", None)
            if said == BY_COLUMN:
                guess = roles.picked(self._menus.guess.mapping, "trial")
                first = next(iter(self._menus.columns("trial").values()))
                mapping = self._menus.with_column(mapping, "trial", guess.place if guess else first)
        self._take_over(mapping)

    def _number(self, key: str, value: Any) -> None:
        if value:
            self._take_over({**self._mapping, key: float(value)})

    def _edited(self) -> None:
        text = self._text.value_input or self._text.value
        try:
            self._take_over(mapping_of(text), text)
        except DataError as fault:
            self._problem.show(str(fault))

    def _watch(self) -> None:
        def on(widget: Any, act: Callable[[], None]) -> None:
            on_change(widget, lambda: None if self._quiet or self._menus is None else act())

        for role, menu in self._columns.items():
            on(menu, partial(self._pick, role))
        for role, menu in self._units.items():
            on(menu, partial(self._pick_unit, role))
        on(self._commanded, self._tell)
        on(self._running, self._run)
        on(self._scale, lambda: self._scaled(self._scale.value))
        on(self._wheelbase, lambda: self._number("wheelbase_m", self._wheelbase.value))
        on(self._trials, self._cut)
        on(self._seconds, self._cut)
        on(self._text, self._edited)
        on_change(self._advanced, lambda: setattr(self._text, "visible", self._advanced.value))

    def _run(self) -> None:
        if self._running.value in RUNNING:
            self._take_over(roles.with_running(self._mapping, self._running.value))

    def _scaled(self, value: float | None) -> None:
        if value:
            self._take_over(roles.with_wheel_scale(self._mapping, float(value)))

    def _laid_out(self) -> Any:
        self._text.visible = False
        lines = [row(self._columns[role], self._units[role]) for role in ROLES if role != "trial"]
        menus = pn.Column(
            row(self._trials, self._seconds, self._columns["trial"]),
            lines[0],
            self._commanded,
            *lines[1:],
            self._running,
            row(self._scale, self._wheelbase),
            **WIDE,
        )
        shown = pn.Column(self._problem.view, self._said, drawn(self._picture.figure), **WIDE)
        ends = row(self._take, self._advanced)
        return pn.Column(
            heading("What the columns mean"),
            html("<p>Guessed from names and sizes: check every line.</p>"),
            self._remarks,
            beside(menus, shown, least=330),
            ends,
            self._text,
            self._save,
            **WIDE,
        )
