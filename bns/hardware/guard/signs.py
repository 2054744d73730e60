"""Signs that nobody looks after a robot: the computer slept, the trial's process was stopped. Standard library alone."""

from __future__ import annotations

import time
from pathlib import Path

_TOGETHER_S, _READINGS = 0.01, 5
"""Two clocks are read within so many seconds of each other, at one of so many readings: a process may be stopped between."""

STOPPED, GONE, GONE_BOTH = "was stopped", "is gone", "are gone"
_STATES = {b"T": STOPPED, b"t": STOPPED, b"Z": GONE, b"X": GONE}
"""Of a process, in proc_pid_stat(5)."""


def slept_s() -> float:
    """Seconds since the boot that the computer was suspended: the steady clock stands still then."""
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    if boot is None:
        return 0.0
    for _ in range(_READINGS):
        steady_s, since_boot_s = time.monotonic(), time.clock_gettime(boot)
        if time.monotonic() - steady_s < _TOGETHER_S:
            break
    return since_boot_s - steady_s


def not_running(process: int) -> str:
    """That a process was stopped (SIGSTOP, a debugger) or is gone (its parent has not asked after it yet); "" where it runs, and
    where the system does not tell."""
    try:
        stat = Path(f"/proc/{process}/stat").read_bytes()
    except OSError:
        return ""
    return _STATES.get(stat[stat.rfind(b")") + 2 : stat.rfind(b")") + 3], "")
