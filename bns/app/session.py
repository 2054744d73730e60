"""What a tab is about, as a file: the log by its path and digest, the model, the switches, the snapshots. It holds no program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import yaml

from bns.api.measurements import Measurements
from bns.api.model import Model
from bns.app.log.part import KEYS, read_part
from bns.app.switches import Switches, Term
from bns.app.tab import Tab
from bns.errors import DataError, ModelError
from bns.safe_yaml import read_yaml

FORMAT = 1
ENDING = ".session.yaml"
"""Of a name that a session is saved under; any name that ends in .yaml is read."""
_LINES = 20
"""Among the first so many the file says what it is."""
_KEYS = {"bns_session", "log", "model", "switches", "snapshots"}
_LOG_KEYS = {"files", "sha256", "mapping", *KEYS}


def session_yaml(tab: Tab) -> str:
    """The text of a session file. DataError while no log is open."""
    if tab.log is None:
        raise DataError("A session needs a log; open one first.")
    tree: dict[str, Any] = {
        "bns_session": FORMAT,
        "log": {"files": list(tab.files), "sha256": tab.log.sha256, **tab.part.plain()},
        "model": {
            "words": list(tab.model_words),
            **({"networks": tab.networks} if tab.networks else {"yaml": tab.model.to_yaml()}),
        },
        "switches": _plain(tab.now),
        "snapshots": {name: _plain(state) for name, state in tab.snapshots.items()},
    }
    if tab.mapping is not None:
        tree["log"]["mapping"] = dict(tab.mapping)
    return yaml.safe_dump(tree, sort_keys=False, allow_unicode=True)


def is_session(path: Path) -> bool:
    """Does the file say of itself that it is a session?"""
    if path.suffix not in {".yaml", ".yml"} or not path.is_file():
        return False
    with path.open(encoding="utf-8", errors="replace") as file:
        return any(line.startswith("bns_session:") for line in islice(file, _LINES))


def opened(path: Path) -> Tab:
    """A tab as the file says. The log is looked for where it was, and beside the session file.

    Raises:
        DataError: the file is no session, or its log is gone or has other numbers.
        ModelError: its model cannot be used.
    """
    tree = _read(path)
    log, model, tab = tree["log"], tree["model"], Tab()
    files = [str(_found(str(name), path.parent)) for name in _list(log, "files", path)]
    mapping = log.get("mapping")
    measured = Measurements(files if mapping is None else files[:1], mapping=mapping)  # a mapping names the others itself
    if measured.sha256 != log.get("sha256"):
        raise DataError(
            f"{files[0]} is not the log that {path.name} was saved with: its data differ. "
            "Open that log alone, or find the one that the session names."
        )
    given = _model(model, path, tab)
    tab.take(given, tuple(str(word) for word in model.get("words") or (_name(given),)))
    tab.open(measured, files if mapping is None else files[:1], mapping, files=files)
    tab.take_part(read_part(log, str(path)))
    snapshots = tree.get("snapshots") or {}
    tab.history.to(_switches(tree["switches"], path))
    tab.snapshots.update({str(name): _switches(state, path) for name, state in snapshots.items()})
    known = set(tab.bench.catalogue) if tab.bench is not None else set()
    for state in (tab.now, *tab.snapshots.values()):
        _check(state, known, path)
    return tab


def _plain(state: Switches) -> dict[str, Any]:
    moved = [{"effect": e, "parameter": p, "value": float(v)} for (e, p), v in state.by_hand]
    return {"on": list(state.on), "by_hand": moved, "formulas": [vars(t).copy() for t in state.terms]}


def _switches(tree: Any, path: Path) -> Switches:
    try:
        moved = tuple(((str(m["effect"]), str(m["parameter"])), float(m["value"])) for m in tree.get("by_hand", ()))
        terms = tuple(Term(str(t["name"]), str(t["term"]), str(t["on"])) for t in tree.get("formulas", ()))
        return Switches(tuple(map(str, tree.get("on", ()))), moved, terms)
    except (AttributeError, KeyError, TypeError, ValueError) as fault:
        raise DataError(
            f"{path}: switches need on, by_hand (effect, parameter, value) and formulas (name, term, on)."
        ) from fault


def _read(path: Path) -> dict[str, Any]:
    try:
        tree, _lines = read_yaml(path.read_text(encoding="utf-8"), str(path), DataError)
    except (OSError, UnicodeDecodeError) as fault:
        raise DataError(f"{path} cannot be read: {fault}.") from fault
    if not isinstance(tree, dict) or "bns_session" not in tree:
        raise DataError(f"{path} is not a session of bns explore; those begin with bns_session: {FORMAT}.")
    if tree["bns_session"] != FORMAT:
        raise DataError(f"{path} is a session of format {tree['bns_session']}; this version reads format {FORMAT}.")
    unknown, missing = set(tree) - _KEYS, _KEYS - {"snapshots"} - set(tree)
    if unknown or missing:
        wrong = f"unknown {', '.join(sorted(map(str, unknown)))}" if unknown else f"lacks {', '.join(sorted(missing))}"
        raise DataError(f"{path}: {wrong}; a session has {', '.join(sorted(_KEYS))}.")
    for key in ("log", "model"):
        if not isinstance(tree[key], dict):
            raise DataError(f"{path}: {key} must have keys.")
    if set(tree["log"]) - _LOG_KEYS:
        raise DataError(f"{path}: log has {', '.join(sorted(_LOG_KEYS))}, and no other key.")
    return tree


def _list(tree: Mapping[str, Any], key: str, path: Path) -> Sequence[Any]:
    values = tree.get(key)
    if not isinstance(values, list) or not values:
        raise DataError(f"{path}: log needs {key}, a list with one entry or more.")
    return values


def _found(name: str, folder: Path) -> Path:
    """The file where it was, or beside the session."""
    for place in (Path(name), folder / Path(name).name):
        if place.is_file():
            return place
    raise DataError(f"The session's log {name} is not there. Put {Path(name).name} beside the session file.")


def _name(model: Model | str) -> str:
    return model if isinstance(model, str) else model.name


def _model(tree: Mapping[str, Any], path: Path, tab: Tab) -> Model | str:
    """Read as a model file would be: effects that are programs are refused as there; or the name of networks."""
    if isinstance(tree.get("networks"), str):
        return str(tree["networks"])
    text = tree.get("yaml")
    if not isinstance(text, str):
        raise DataError(f"{path}: model needs yaml, the text of a model file.")
    kept = tab.folder / "session-model.yaml"
    kept.write_text(text, encoding="utf-8")
    try:
        return Model(kept)
    except ModelError as fault:
        raise ModelError(f"{path}: {str(fault).replace(str(kept), 'its model')}") from fault


def _check(state: Switches, known: set[str], path: Path) -> None:
    unknown = [name for name in state.on if name not in known and name not in {t.name for t in state.terms}]
    if known and unknown:
        raise DataError(f"{path}: there is no effect {unknown[0]} for this model; `bns effects` lists them.")
