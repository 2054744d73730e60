"""Whether a Wii remote lives, asked without waiting for lights that move.

Linux asks the remote for its status whenever the charge of its battery is read, and gives an error if it does not answer
(drivers/hid/hid-wiimote-modules.c, `wiimod_battery_get_property`). That may take a second, so it is done in a thread.
"""

from __future__ import annotations

import threading
from pathlib import Path

from bns.hardware.clock import Clock

_BETWEEN_S = 0.05
_SYSFS = "/sys/"


class Pulse:
    """Reads `battery`, a file, whenever nothing was reported for a while; when it last could be read."""

    def __init__(self, battery: str | Path, clock: Clock) -> None:
        self._file, self._clock = Path(battery), clock
        self._alive_s = self._asked_s = -1.0
        self._wanted, self._open = threading.Event(), True
        # A file that is no driver's is read at once: no remote is waited for, and an emulated clock waits for no threads.
        self._thread = threading.Thread(target=self._watch, name="wii pulse", daemon=True) if _is_driver_s(self._file) else None
        if self._thread is not None:
            self._thread.start()

    def last_s(self, reported_s: float) -> float:
        """When the remote last gave a sign of life: a report, or an answer asked for because there was none."""
        now_s = self._clock.now_s()
        if now_s - max(reported_s, self._asked_s) >= _BETWEEN_S:
            self._asked_s = now_s
            if self._thread is None:
                self._ask()
            else:
                self._wanted.set()
        return max(reported_s, self._alive_s)

    def close(self) -> None:
        """Ask no more."""
        self._open = False
        self._wanted.set()

    def _watch(self) -> None:
        while self._open:
            self._wanted.wait()
            self._wanted.clear()
            if self._open:
                self._ask()

    def _ask(self) -> None:
        began_s = self._clock.now_s()
        try:
            self._file.read_text()
        except OSError:  # it does not answer
            return
        self._alive_s = began_s


def battery_of(device: str, root: Path = Path("/sys/class/input")) -> Path | None:
    """The charge of the battery of the remote whose event device this is; None if the kernel has none."""
    found = sorted((root / Path(device).resolve().name / "device" / "device" / "power_supply").glob("*/capacity"))
    return found[0] if found else None


def _is_driver_s(file: Path) -> bool:
    return str(file).startswith(_SYSFS)
