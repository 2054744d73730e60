"""The figures' scripts, run in a process of their own.

They come with the package (``analysis/``) and stand on it: the package does not import them, and a figure that fails does
not end what called it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from bns.errors import BnsError
from bns.shipped import PACKAGE, shipped_root


def scripts() -> Path:
    """Folder that ``python -m analysis`` is found in.

    Raises:
        BnsError: this package came without them.
    """
    root = shipped_root("analysis")
    if root is None:
        raise BnsError(
            f"the figures' scripts did not come with this package (there is no folder analysis in or next to {PACKAGE}). "
            "Reinstall bns, from a wheel or a whole checkout: pip install --force-reinstall bns"
        )
    return root


def draw(root: Path, results: Path, *options: str, polite: bool = True) -> str:
    """Run the figures' scripts, politely after a sweep's own processes; "" if all went well, else what they complain of."""
    after_others = ["nice", "-n", "10"] if polite and shutil.which("nice") else []
    command = [*after_others, *_command(results), *options]
    # In a session of its own, so that Ctrl-C reaches this process alone, which then ends the other.
    with subprocess.Popen(
        command, env=_surroundings(root), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        try:
            _, complaint = process.communicate()
        except BaseException:
            process.terminate()
            raise
    return "" if process.returncode == 0 else (complaint.strip().splitlines() or ["the figures' scripts failed"])[-1]


def carry_out(results: Path, *options: str) -> int:
    """Run the figures' scripts in the foreground: what they print is seen, Ctrl-C ends them. Their exit code."""
    with subprocess.Popen([*_command(results), *options], env=_surroundings(scripts())) as process:
        try:
            return process.wait()
        except KeyboardInterrupt:
            process.wait()  # it had the same signal
            raise


def _command(results: Path) -> list[str]:
    return [sys.executable, "-m", "analysis", "--results", str(results.absolute())]


def _surroundings(root: Path) -> Mapping[str, str]:
    """The environment in which ``analysis`` is found, and this very package, however it was found itself."""
    places = [str(root), str(PACKAGE.parent), os.environ.get("PYTHONPATH", "")]
    return os.environ | {"PYTHONPATH": os.pathsep.join(place for place in places if place)}
