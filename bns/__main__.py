"""`bns` and `python -m bns`: the command line, loaded so that an interrupt meanwhile ends it in one line, too."""

from __future__ import annotations

import sys

_INTERRUPTED = 130


def main() -> int:
    """The command line with the arguments of this process; its exit code."""
    try:
        from bns.cli.main import main as command_line  # noqa: PLC0415  # takes most of a second

        return command_line()
    except KeyboardInterrupt:
        return _interrupted()
    except ImportError as error:
        if not isinstance(error.__context__, KeyboardInterrupt):  # some libraries in C report an interrupt as a failed import
            raise
        return _interrupted()


def _interrupted() -> int:
    print("bns: interrupted", file=sys.stderr)
    return _INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
