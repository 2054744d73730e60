"""The reference of the command line, made from its parsers."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from bns.cli.main import _parser
from bns.cli.parser import Parser

PAGE = "reference/commands.md"
_HEAD = """\
# Command line

This page is made from the command line's own parsers when the site is built. `bns COMMAND --help` prints the same.

Exit codes: 0 done, 1 some runs of a sweep failed, 2 bad input (nothing was written), 130 interrupted with Ctrl-C,
143 terminated. A trial on a robot has two more: 3 paused, 4 the robot may still be moving ([trials](../trials.md)).

| command | what it does |
|---|---|
"""


def page() -> str:
    """Every command: usage, options, defaults."""
    whole = _parser()
    subparsers = next(a for a in whole._actions if isinstance(a, argparse._SubParsersAction))
    short = [(choice.dest, choice.help or "") for choice in subparsers._choices_actions]
    head = _HEAD + "\n".join(f"| [bns {name}](#bns-{name}) | {_cell(text)} |" for name, text in short)
    return "\n".join([head, "", *(line for name, _ in short for line in _section(name, subparsers.choices[name], 2))])


def _section(name: str, parser: Parser, level: int) -> Iterator[str]:
    yield f"{'#' * level} bns {name}\n"
    yield f"{parser.description or ''}\n"
    yield f"```text\n{parser.format_usage().strip()}\n```\n"
    for group in parser._action_groups:
        actions = [a for a in group._group_actions if _shown(a)]
        if actions:
            title = group.title or "options"
            yield f"**{title[:1].upper()}{title[1:]}**{': ' + group.description if group.description else ''}\n"
            yield "| option | what |\n|---|---|"
            yield from (f"| {_names(a)} | {_help(parser, a)} |" for a in actions)
            yield ""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below, inner in action.choices.items():
                yield from _section(f"{name} {below}", inner, level + 1)


def _shown(action: argparse.Action) -> bool:
    hidden = action.help is argparse.SUPPRESS or isinstance(action, argparse._HelpAction | argparse._SubParsersAction)
    return not hidden


def _names(action: argparse.Action) -> str:
    value = argparse.HelpFormatter("")._format_args(action, action.metavar or action.dest) if action.nargs != 0 else ""
    if not action.option_strings:
        return f"`{_cell(value)}`"
    return _cell(f"`{', '.join(action.option_strings)}{' ' + _choice(action, value) if value else ''}`")


def _choice(action: argparse.Action, value: str) -> str:
    if action.choices and not action.metavar:
        return "{" + ",".join(map(str, action.choices)) + "}"
    return value if action.metavar else value.upper()


def _help(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    text = parser._get_formatter()._expand_help(action) if action.help else ""
    return _cell(text)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")
