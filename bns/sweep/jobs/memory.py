"""Peak memory of one run in a process that runs many."""

from __future__ import annotations

import sys
from pathlib import Path

_STATUS, _CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def reset_peak() -> None:
    """Forget the peak so far. Only Linux can; elsewhere the peak stays that of the process's life."""
    try:
        _CLEAR.write_text("5")
    except OSError:
        return


def peak_mib() -> float:
    """Largest resident memory since ``reset_peak`` in MiB; NaN where the system does not tell."""
    try:
        # Not getrusage: its peak is inherited from the parent process at exec.
        lines = _STATUS.read_text().splitlines()
    except OSError:
        return _peak_of_life_mib()
    peaks = [float(line.split()[1]) for line in lines if line.startswith("VmHWM:")]
    return peaks[0] / 1024 if peaks else _peak_of_life_mib()


def _peak_of_life_mib() -> float:
    if sys.platform == "win32":
        return float("nan")
    import resource  # noqa: PLC0415 - not there on Windows

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)
