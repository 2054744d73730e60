"""Signs that nobody looks after a robot: the computer slept, the trial's process was stopped. Standard library alone."""

from __future__ import annotations

import time
from pathlib import Path


def slept_s() -> float:
    """Seconds since the boot that the computer was suspended: the steady clock stands still then."""
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    return 0.0 if boot is None else time.clock_gettime(boot) - time.monotonic()


def frozen(process: int) -> bool:
    """Whether a process was stopped (SIGSTOP, a debugger); False where the system does not tell."""
    try:
        stat = Path(f"/proc/{process}/stat").read_bytes()
    except OSError:
        return False
    return stat[stat.rfind(b")") + 2 : stat.rfind(b")") + 3] in {b"T", b"t", b"Z", b"X"}
