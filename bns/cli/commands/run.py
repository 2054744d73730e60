"""`bns run`: one run by hand, with a live view while it goes on."""

from __future__ import annotations

from pathlib import Path

from bns.api.run import run_spec
from bns.console import live_view
from bns.spec import RunSpec


def run_by_hand(
    spec: RunSpec,
    results: Path,
    sweep: str,
    save_snn: Path | None = None,
    render: Path | None = None,
    measurements: Path | None = None,
    device: str = "cpu",
) -> str:
    """Carry out a run with a live view and keep it; the report in words."""
    with live_view(spec) as show:
        done = run_spec(
            spec,
            keep=results,
            sweep=sweep,
            measurements=measurements,
            save_networks=save_snn,
            render=render,
            device=device,
            on_evaluation=show,
        )
    return done.summary()
