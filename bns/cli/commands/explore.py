"""The command that opens the page: explore."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path

from bns.cli.options.measuring_options import add_model, model_of
from bns.cli.parser import Adder, add_trust

LARGEST_PORT = 65_535


def add_commands(command: Adder) -> None:
    """The parser of this command."""
    page = command("explore", explore, "open an interactive page in the browser: switch effects on and watch the error fall")
    page.add_argument(
        "data",
        type=Path,
        nargs="*",
        metavar="LOG",
        help="measurements: .csv, .parquet, or any file with a mapping; or a saved session, or a folder of results (default: "
        "the page offers sample logs)",
    )
    add_model(page, networks=True, default="khepera")
    page.add_argument("--port", type=_port, default=0, metavar="N", help="port on 127.0.0.1 (default: a free one)")
    page.add_argument("--no-browser", action="store_true", help="print the address without opening a browser")
    add_trust(page)


def explore(options: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C or SIGTERM, which is how it is meant to end: exit code 0."""
    from bns.app.explore import Explorer, shown_of
    from bns.extras import require

    require("app", "panel", "bokeh")
    logging.getLogger("tornado.access").setLevel(logging.ERROR)  # no line for every file that the browser fetches
    words = (options.model, *([] if options.wheelbase is None else ["--wheelbase", f"{options.wheelbase:g}"]))
    files = [str(file) for file in options.data]
    log = files[0] if len(files) == 1 else files or None
    explorer = Explorer(shown_of(log, model_of(options), files, words), options.port)
    print(explorer.address, flush=True)
    print("open this address in a browser on this machine; Ctrl-C ends the page", flush=True)
    explorer.serve(browser=not options.no_browser)
    return 0


def _port(text: str) -> int:
    if not text.isdigit() or int(text) > LARGEST_PORT:
        raise argparse.ArgumentTypeError(f"{text!r} is no port; give a whole number from 0 (any) to {LARGEST_PORT}")
    return int(text)
