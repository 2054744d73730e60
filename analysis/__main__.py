"""Draw the figures: ``python -m analysis --results results [--only NAME] [--out results/figures]``."""

from __future__ import annotations

import argparse
import json
import pkgutil
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pandas as pd

import analysis
from analysis.common import Drawn, NoDataError, Store, among
from bns.errors import BnsError, SpecError, unknown_name
from bns.plotting import save
from bns.store.files import publish


def figures() -> dict[str, ModuleType]:
    """The figure modules in this folder, by NAME."""
    names = [found.name for found in pkgutil.iter_modules(analysis.__path__) if not found.name.startswith("_")]
    modules = [import_module(f"analysis.{name}") for name in sorted(names)]
    return {module.NAME: module for module in modules if hasattr(module, "NAME")}


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw what the store has data for; 0, or 2 with one line on stderr."""
    wanted = _parser().parse_args(arguments)
    try:
        _draw_all(_chosen(wanted.only), wanted.results, wanted.out or wanted.results / "figures")
    except BnsError as fault:
        print(f"error: {fault}", file=sys.stderr)
        return fault.exit_code
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m analysis", description="Draw figures from stored results.")
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of the results (results)")
    parser.add_argument("--only", metavar="NAME", help="one figure: " + ", ".join(figures()))
    parser.add_argument("--out", type=Path, help="folder of the figures (RESULTS/figures)")
    return parser


def _chosen(only: str | None) -> dict[str, ModuleType]:
    found = figures()
    if only is None:
        return found
    if only not in found:
        raise SpecError(unknown_name("figure", only, found))
    return {only: found[only]}


def _draw_all(modules: dict[str, ModuleType], results: Path, out: Path) -> None:
    store = Store(results)
    for number, (name, module) in enumerate(modules.items(), 1):
        _progress(f"[{number}/{len(modules)}] {name}")
        try:
            for drawn in module.draw(store):
                png = _publish(drawn, module.PAPER, store, out)
                print(f"{png}  ({module.PAPER}, n = {drawn.n:,} runs)")
        except NoDataError as reason:
            print(f"{name} ({module.PAPER}) skipped: {reason}")


def _publish(drawn: Drawn, paper: str, store: Store, out: Path) -> Path:
    """Write NAME.png, NAME.svg and, beside them, the caption as NAME.json; the path of the PNG."""
    png, svg = save(drawn.figure, out / drawn.name)
    caption = {
        "name": drawn.name,
        "paper": paper,
        "shows": drawn.shows,
        "n": drawn.n,
        "missing": list(drawn.missing),
        "sweeps": list(drawn.sweeps),
        "files": [png.name, svg.name],
        **_origins(store, drawn.sweeps),
    }
    data = (json.dumps(caption, indent=2, ensure_ascii=False) + "\n").encode()
    publish(data, out / f".{drawn.name}.json.part", out / f"{drawn.name}.json")
    return png


def _origins(store: Store, sweeps: Sequence[str]) -> dict[str, Any]:
    """Spec hashes, commits and versions that the results of ``sweeps`` come from."""
    hashes = store.query(f"SELECT DISTINCT spec_hash FROM specs WHERE {among('sweep', sweeps)} ORDER BY 1")
    made = store.query(
        f"SELECT DISTINCT git_sha, git_clean, bns_version FROM runs WHERE {among('sweep', sweeps)} ORDER BY ALL"
    )
    return {
        "spec_hashes": hashes.spec_hash.tolist(),
        "bns_versions": sorted(set(made.bns_version)),
        "git": [
            {"sha": one.git_sha, "clean": None if pd.isna(one.git_clean) else bool(one.git_clean)}
            for one in made.itertuples()
        ],
    }


def _progress(text: str) -> None:
    if sys.stderr.isatty():
        print(text, file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
