"""What to type for the same as the page did: on a command line, and in Python."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from bns.app.log.part import ALL, Part
from bns.app.switches import Switches


def commands(files: Sequence[str], model: Sequence[str], switches: Switches, networks: bool = False) -> list[str]:
    """What to type for the same: one `bns add` for listed effects, and one more for every formula; networks are compared only."""
    data, more = shlex.quote(files[0]), [word for file in files[1:] for word in ("--more", file)]
    base, new = shlex.join(["--model", *model, *more]), shlex.join(["--model", "extended.yaml", *more])
    if networks:
        return [f"bns compare {data} {base}"]
    given = base
    terms = {t.name: t for t in switches.terms}
    names = [n for n in switches.on if n not in terms]
    out = [f"bns compare {data} {base}", f"bns diagnose {data} {base}"]
    if names:
        out.append(f"bns add {data} {' '.join(names)} {base} -o extended.yaml")
        base = new
    for name in (n for n in switches.on if n in terms):
        t = terms[name]
        out.append(f"bns add {data} {shlex.join([name, '--term', t.term, '--on', t.on])} {base} -o extended.yaml")
        base = new
    return [*out, f"bns report {data} {given} -o report.html"]


def python(
    files: Sequence[str], model: Sequence[str], switches: Switches, part: Part = ALL, mapping: Mapping[str, Any] | None = None,
    networks: bool = False,
) -> str:
    """The same in Python; ``mapping``: how the columns were read, where the user said that."""
    terms = {t.name: t for t in switches.terms}
    names = [n for n in switches.on if n not in terms]
    given = f"bns.Model({model[0]!r}" + (f", wheelbase_m={model[2]})" if len(model) > 2 else ")")
    read = "" if mapping is None else f", mapping={_literal(mapping)}"
    lines = ["import bns", "", f"log = bns.Measurements({', '.join(map(repr, files))}{read})", *part.python()]
    if networks:
        return "\n".join([*lines, f"print(bns.compare(log, {model[0]!r}).summary())"])
    lines += [f"model = {given}", "print(bns.compare(log, model).summary())"]
    lines += ["found = bns.diagnose(log, model)", "print(found.summary())"]
    if names:
        lines += [f"added = bns.add(log, {names!r}, model)", "print(added.summary())", "model = added.model"]
    for t in (terms[n] for n in switches.on if n in terms):
        lines += [f"added = bns.add(log, {t.name!r}, model, term={t.term!r}, on={t.on!r})", "print(added.summary())"]
        lines += ["model = added.model"]
    for (effect, parameter), value in switches.by_hand:
        lines += [f"numbers = {{**model.values_of({effect!r}), {parameter!r}: {value!r}}}"]
        lines += [f"model = model.with_effect({effect!r}, **numbers)"]
    saved = ['model.save("extended.yaml")'] if switches.on else []
    return "\n".join([*lines, *saved, 'found.report("report.html")'])


def _literal(tree: Any) -> str:
    """As Python reads it: an endless time has no name of its own there."""
    if isinstance(tree, Mapping):
        return "{" + ", ".join(f"{key!r}: {_literal(value)}" for key, value in tree.items()) + "}"
    if isinstance(tree, list | tuple):
        return "[" + ", ".join(map(_literal, tree)) + "]"
    return f'float("{tree}")' if isinstance(tree, float) and not math.isfinite(tree) else repr(tree)
