"""The reference of `import bns`, made from docstrings: mkdocstrings fills in what each line names."""

from __future__ import annotations

import bns

PAGE = "reference/python.md"
_HEAD = """\
# Python

Everything that `import bns` offers, from its docstrings. [From Python](../python.md) shows the same names in use.
"""
_GROUPS = {
    "Measurements and models": ("Measurements", "Model", "Effect", "Parameter", "effects"),
    "Compare, diagnose, extend": ("compare", "diagnose", "add", "propose", "report", "explore"),
    "Run and sweep": ("run", "Sweep", "trial", "load", "query", "archive"),
}
"""Every other public name stands under "Results" or "Errors"."""


def page() -> str:
    """A heading a group, a block of mkdocstrings a name."""
    listed = {name for names in _GROUPS.values() for name in names}
    rest = [name for name in bns.__all__ if name not in listed and not name.startswith("_")]
    groups = {
        **_GROUPS,
        "Results": tuple(name for name in rest if not name.endswith("Error")),
        "Errors": tuple(name for name in rest if name.endswith("Error")),
    }
    return "\n".join([_HEAD, *(line for title, names in groups.items() for line in _group(title, names))])


def _group(title: str, names: tuple[str, ...]) -> list[str]:
    return [f"## {title}\n", *(_block(name) for name in names)]


def _block(name: str) -> str:
    return f"::: bns.{bns._HOME[name]}.{name}\n    options:\n      heading: bns.{name}\n      heading_level: 3\n"
