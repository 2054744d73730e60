"""The settings as a page of the documentation: `python -m bns.diagnose.settings > docs/settings.md`."""

from __future__ import annotations

import inspect
from itertools import groupby
from typing import Any

from bns.diagnose.settings import DEFAULTS, Settings
from bns.diagnose.settings.setting import BY_HAND

_HEAD = f"""\
# Settings of the diagnosis

Every threshold of `bns diagnose`, `compare`, `add`, `propose` and `report`, grouped by the folder of
`bns/diagnose` that uses it. [How the diagnosis decides](explain/diagnosis.md) explains where they act.

The values are defined in `bns/diagnose/settings`; this page is made from them by `python -m
bns.diagnose.settings > docs/settings.md`. `--json` and `to_json()` carry all of them under `provenance`, with
their digest, here `{{digest}}`. Two results with the same digest were made with the same settings.

To use other values, write `bns diagnose LOG --model MODEL --settings FILE.yaml` or `bns.diagnose(log, model,
settings=...)`. The file has a section for each folder (`select:`, below it `min_gain: 0.02`). What differs from the
default is printed, and is listed in the provenance under `settings_changed`.

Of the {{count}} settings, {{unmeasured}} are marked "{BY_HAND}": no study tried other values of that one alone.
All of them together are judged on generated worlds ([hidden effects](hidden-effects.md)).

Not listed are numbers inside a function (factors by which units are recognised, steps of derivatives) and the
plausible ranges of an effect's parameters; those are on the pages of the [effects](gallery/effects.md).
"""


def page(settings: Settings = DEFAULTS) -> str:
    """Markdown: a table for each folder, with every setting's value, unit and reason."""
    rows = list(settings.rows())
    unmeasured = sum(BY_HAND in row[-1] for row in rows)
    parts = [_HEAD.format(digest=settings.digest(), count=len(rows), unmeasured=unmeasured)]
    for room, group in groupby(rows, key=lambda row: row[0]):
        about = inspect.cleandoc(type(getattr(settings, room)).__doc__ or "")
        lines = [f"| `{name}` | {shown(value)} | {unit} | {why} |" for _, name, value, unit, why in group]
        parts.append(
            "\n".join([f"## {room}\n\n{about}\n", "| setting | value | unit | why |", "|---|---|---|---|", *lines, ""])
        )
    return "\n".join(parts)


def shown(value: Any) -> str:
    """A value as people read it: six digits, parts of a tuple one after the other."""
    if isinstance(value, tuple):
        return ", ".join(" ".join(map(shown, part)) if isinstance(part, tuple) else shown(part) for part in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)
