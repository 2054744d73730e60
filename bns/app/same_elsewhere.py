"""What to type for the same as the page did: on a command line, and in Python."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from bns.app.switches import Switches


def commands(data: str, model: Sequence[str], switches: Switches) -> list[str]:
    """What to type for the same: one `bns add` for listed effects, and one more for every formula."""
    data, base = shlex.quote(data), shlex.join(["--model", *model])
    given = base
    terms = {t.name: t for t in switches.terms}
    names = [n for n in switches.on if n not in terms]
    out = [f"bns compare {data} {base}", f"bns diagnose {data} {base}"]
    if names:
        out.append(f"bns add {data} {' '.join(names)} {base} -o extended.yaml")
        base = "--model extended.yaml"
    for name in (n for n in switches.on if n in terms):
        t = terms[name]
        out.append(f"bns add {data} {shlex.join([name, '--term', t.term, '--on', t.on])} {base} -o extended.yaml")
        base = "--model extended.yaml"
    return [*out, f"bns report {data} {given} -o report.html"]


def python(data: str, model: Sequence[str], switches: Switches, left_out: Sequence[str]) -> str:
    """The same in Python."""
    terms = {t.name: t for t in switches.terms}
    names = [n for n in switches.on if n not in terms]
    given = f"bns.Model({model[0]!r}" + (f", wheelbase_m={model[2]})" if len(model) > 2 else ")")
    lines = ["import bns", "", f"log = bns.Measurements({data!r})"]
    lines += [f"log = log.without({list(left_out)!r})"] if left_out else []
    lines += [f"model = {given}", "print(bns.compare(log, model).summary())"]
    if names:
        lines += [f"added = bns.add(log, {names!r}, model)", "print(added.summary())", "model = added.model"]
    for t in (terms[n] for n in switches.on if n in terms):
        lines += [f"added = bns.add(log, {t.name!r}, model, term={t.term!r}, on={t.on!r})", "print(added.summary())"]
        lines += ["model = added.model"]
    for (effect, parameter), value in switches.by_hand:
        lines += [f"numbers = {{**model.values_of({effect!r}), {parameter!r}: {value!r}}}"]
        lines += [f"model = bns.Model(model.with_effect({effect!r}, **numbers))"]
    return "\n".join([*lines, 'bns.Model(model).save("extended.yaml")'])
