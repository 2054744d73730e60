"""A parser that says what was probably meant, takes no abbreviations, and goes on understanding the old spellings."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn

SHELLS = ("bash", "zsh", "tcsh")
_NO_VALUE = "expected one argument"
_MISSING = "the following arguments are required:"


class Parser(argparse.ArgumentParser):
    """`argparse.ArgumentParser` with suggestions.

    ``rewrite``: from the words of the command line to what they are written as today, for spellings that are on their way out.
    ``words``: those that are being parsed. ``old``: what was understood of them in an old spelling (`warn_old`), which is said
    once all of them are.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **{**options, "allow_abbrev": False})
        self.rewrite: Callable[[list[str]], list[str]] = list
        self.words: list[str] = []
        self.old: list[tuple[str, str, str]] = []

    def parse_known_args(  # type: ignore[override]  # only as it is called here
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """As its parent's, but nothing stays unknown, and help is a command's own, not that of ``bns``."""
        words = self.words = self.rewrite(list(sys.argv[1:] if args is None else args))
        for word in self._own(words):
            if word.startswith("--") and len(word) > 2 and " " not in word:
                self._check_option(word.partition("=")[0])
        found, unknown = super().parse_known_args(words, namespace)
        if unknown:
            of_results = "--results" in self._option_string_actions and "--task" not in self._option_string_actions
            meant = f" Did you mean --results {unknown[0]}?" if of_results and len(unknown) == 1 and unknown[0][0] != "-" else ""
            self.error(f"{' '.join(unknown)}: unexpected argument.{meant}")
        while self.old:
            warn_old(*self.old.pop(0))
        return found, unknown

    def _own(self, words: list[str]) -> Iterable[str]:
        """The words that are not a command's below this one, nor behind ``--``."""
        below = self._commands()
        for word in words:
            if word == "--" or (below and not word.startswith("-")):
                return
            yield word

    def _check_option(self, option: str) -> None:
        valid = [name for name in self._option_string_actions if name.startswith("--")]
        if option not in valid:
            self.error(f"there is no option {option}.{_meant(option, valid)}")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if isinstance(action, argparse._SubParsersAction) and value not in action.choices:
            near = get_close_matches(str(value), action.choices, n=1, cutoff=0.5)
            below = f"; its options: bns {near[0]} --help" if near else ""
            self.exit(2, f"bns: there is no command {value}.{_meant(value, action.choices)} All of them: bns --help{below}\n")
        super()._check_value(action, value)

    def error(self, message: str) -> NoReturn:
        """One line that says what is wrong and where help is; where something is missing, also what is always needed."""
        needed = [_written(action) for action in self._actions if action.required]
        short = f" Needed: {self.prog} {' '.join(needed)}." if needed and message.startswith(_MISSING) else ""
        said = message.replace(_MISSING, "missing:")
        if message.endswith(_NO_VALUE):
            option = message.removeprefix("argument ").split(":")[0].split("/")[-1]
            said += f'. A value that begins with "-" is written {option}=VALUE, without a space'
        self.exit(2, f"bns: {said}{'' if said.endswith(('.', '?')) else '.'}{short} All options: {self.prog} --help\n")

    def _commands(self) -> dict[str, argparse.ArgumentParser]:
        for action in self._actions:
            if isinstance(action, argparse._SubParsersAction):
                return dict(action.choices)
        return {}


Adder = Callable[[str, Callable[[argparse.Namespace], int], str], Parser]
"""What makes the parser of a command, of its name, its function and a text."""


def _written(action: argparse.Action) -> str:
    """An argument as it is written on the command line."""
    value = str(action.metavar or action.dest.upper())
    return f"{action.option_strings[-1]} {value}" if action.option_strings else value


def _meant(given: str, valid: Iterable[str]) -> str:
    names = list(valid)
    begun = [name for name in names if len(given) > 3 and name.startswith(given)]
    near = begun[:1] or get_close_matches(given, names, n=1, cutoff=0.6)
    return f" Did you mean {near[0]}?" if near else ""


class Completion(argparse.Action):
    """Print the completion of the command line for a shell, and end."""

    def __call__(self, parser: argparse.ArgumentParser, _options: object, shell: Any, _name: str | None = None) -> None:
        """``shell`` is one of `SHELLS`."""
        import shtab

        _mark_files(parser, shtab.FILE, shtab.DIRECTORY)
        print(shtab.complete(parser, shell), flush=True)  # a closed pipe is noticed here, not at the exit
        parser.exit(0)


def _mark_files(parser: argparse.ArgumentParser, file: object, folder: object) -> None:
    """Say of every argument that is a path that the shell knows how to complete it."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                _mark_files(below, file, folder)
        elif action.type is Path:
            action.complete = folder if action.metavar == "DIR" else file  # type: ignore[attr-defined]  # shtab's


class OldFolder(argparse.Action):
    """A folder of results that is written as an option today: it works, with a warning. ``metavar`` is the option."""

    def __call__(self, parser: argparse.ArgumentParser, options: Any, value: Any, _name: str | None = None) -> None:
        """Take the value over, unless the option is given as well, or it names a figure and no folder."""
        assert isinstance(parser, Parser)
        figure = _is_figure(value)
        if any(word.partition("=")[0] == self.metavar for word in parser.words):
            name = value if figure else "NAME"
            parser.error(
                f"{value} has no meaning beside {self.metavar}, which gives the folder of results. Leave it out; "
                f"to draw one figure alone: bns figures --only {name}."
            )
        if figure and not Path(value).is_dir():
            parser.error(
                f"{value} is the name of a figure, not a folder of results. To draw it alone: bns figures --only {value}."
            )
        parser.old.append((parser.prog, str(value), f"{self.metavar} {value}"))
        setattr(options, self.dest, Path(value))  # no `type`: that would convert the absence, too


def _is_figure(word: str) -> bool:
    """Does a script that came with this package, or an installed package, draw a figure of that name?"""
    from bns.registry import FIGURES
    from bns.shipped import shipped_root

    root = shipped_root("analysis")
    scripts = (root / "analysis").glob("*.py") if root else ()
    line = f'NAME = "{word}"'
    return FIGURES.is_plugin(word) or any(line in script.read_text(encoding="utf-8").splitlines() for script in scripts)


def warn_old(command: str, old: str, new: str) -> None:
    """Say on stderr what to write from the next release on."""
    print(f"bns: warning: {command} … {old} is an old spelling, not accepted by the next release; write {new}", file=sys.stderr)


def data_first(words: list[str]) -> list[str]:
    """``EFFECT … --data FILE``, as `bns add` was once written, as ``FILE EFFECT …``, with a warning."""
    for place, word in enumerate(words):
        option, equals, value = word.partition("=")
        if option == "--data" and (equals or place + 1 < len(words)):
            file, rest = (value, words[place + 1 :]) if equals else (words[place + 1], words[place + 2 :])
            warn_old("bns add", f"--data {file}", f"bns add {file} EFFECT")
            return [file, *words[:place], *rest]
    return words


def add_results(parser: argparse.ArgumentParser, *, once_positional: bool = False) -> None:
    """``--results DIR``; ``once_positional``: the folder alone is understood as well, with a warning."""
    parser.add_argument(
        "--results", type=Path, default=Path("results"), metavar="DIR", help="folder of all results (default: results)"
    )
    if once_positional:
        parser.add_argument(
            "results", nargs="?", default=argparse.SUPPRESS, action=OldFolder, metavar="--results", help=argparse.SUPPRESS
        )  # fmt: skip


class OldTrust(argparse.Action):
    """``--also`` where it once allowed a file, as ``--trust-file`` does today: it works, with a warning."""

    def __call__(self, parser: argparse.ArgumentParser, options: Any, value: Any, name: str | None = None) -> None:
        """Allow the file."""
        assert isinstance(parser, Parser)
        parser.old.append((parser.prog, f"{name} {value}", f"--trust-file {value}"))
        options.trust_file = [*options.trust_file, value]


def add_trust(parser: argparse.ArgumentParser, *, once_also: bool = False) -> None:
    """Which Python files that a model names may run; ``once_also``: ``--also`` is understood as well, with a warning."""
    parser.add_argument(
        "--trust", action="store_true", help="run all Python files that a model names (they are programs)"
    )
    parser.add_argument(
        "--trust-file",
        action="append",
        default=[],
        metavar="FILE.py",
        help="run this Python file if a model names it (may be repeated)",
    )
    if once_also:
        parser.add_argument("--also", action=OldTrust, default=argparse.SUPPRESS, metavar="FILE.py", help=argparse.SUPPRESS)


def take_trust(options: argparse.Namespace) -> None:
    """Let those Python files run that the command line names, or all."""
    given = [word for name in ("trust_file", "also", "effects") for word in getattr(options, name, [])]
    named = [name for name in given if name.endswith(".py")]
    everything = getattr(options, "trust", False)
    if everything or named:
        from bns.physics.trust import trust, trust_all

        trust(named)
        if everything:
            trust_all()
