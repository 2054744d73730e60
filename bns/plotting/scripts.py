"""The figures' scripts, run in a process of their own.

They stand beside the package in a checkout (``analysis/``): the package does not depend on them, and a figure that fails
does not end what called it.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import bns
from bns.errors import BnsError


def scripts() -> Path:
    """Folder that ``python -m analysis`` is found in.

    Raises:
        BnsError: this package was installed without a checkout.
    """
    root = Path(bns.__file__).resolve().parents[1]
    if not (root / "analysis" / "__main__.py").is_file():
        raise BnsError(
            f"the figures' scripts are not beside the package ({root / 'analysis'} is missing): they come with a checkout, "
            "not with an installed package. Run bns from a checkout (make setup), or draw elsewhere with python -m analysis."
        )
    return root


def draw(root: Path, results: Path, *options: str, polite: bool = True) -> str:
    """Run the figures' scripts, politely after a sweep's own processes; "" if all went well, else what they complain of."""
    after_others = ["nice", "-n", "10"] if polite and shutil.which("nice") else []
    command = [*after_others, sys.executable, "-m", "analysis", "--results", str(results.absolute()), *options]
    # In a session of its own, so that Ctrl-C reaches this process alone, which then ends the other.
    with subprocess.Popen(
        command, cwd=root, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        try:
            _, complaint = process.communicate()
        except BaseException:
            process.terminate()
            raise
    return "" if process.returncode == 0 else (complaint.strip().splitlines() or ["the figures' scripts failed"])[-1]
