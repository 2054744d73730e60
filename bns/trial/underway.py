"""What somebody who watches a drive wants to know: where the robot is and has been, its battery, how long it still takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bns.hardware.clock import Clock

_WIDE, _HIGH = 48, 14
_LEAST_M = 0.2


class Underway:
    """Listens to the hardware log while a robot drives. `text` is for a screen that is drawn again and again, from any thread."""

    def __init__(self, clock: Clock, goals_m: np.ndarray | None = None) -> None:
        self._clock = clock
        self.goals_m = np.empty((0, 2)) if goals_m is None else np.asarray(goals_m, np.float64)
        self.path: list[tuple[float, float]] = []
        """Places (x_m, y_m) of the drive that goes on, or of the last."""
        self._pose: Sequence[float] = ()
        self._moves, self._began_s, self._lasts_s = False, 0.0, 0.0
        self._command, self._of = 0, 0
        self._readings: Mapping[str, float] = {}

    def begins(self, commands: int, lasts_s: float, readings: Mapping[str, float]) -> None:
        """A drive of so many commands, s."""
        self.path, self._pose, self._command, self._of = [], (), 0, commands
        self._lasts_s, self._readings, self._began_s, self._moves = lasts_s, readings, self._clock.now_s(), True

    def ends(self) -> None:
        """The robot stands."""
        self._moves = False

    def heard(self, kind: str, what: Mapping[str, Any]) -> None:
        """An event of the log."""
        if kind == "seen" and self._moves:
            self._pose = what["pose"]
            self.path.append((what["pose"][0], what["pose"][1]))
        elif kind == "command":
            self._command += 1

    def text(self) -> str:
        """Lines, none while the robot stands."""
        if not self._moves:
            return ""
        left_s = max(0.0, self._began_s + self._lasts_s - self._clock.now_s())
        shown = [f"command {self._command} of {self._of}", f"{left_s:.0f} s left"]
        if self._pose:
            x_m, y_m, heading_rad = self._pose
            shown.append(f"x {x_m:+.2f} m, y {y_m:+.2f} m, heading {np.degrees(heading_rad) % 360:.0f}°")
            shown.append(f"{self._way_m():.2f} m driven")
        if "battery_v" in self._readings:
            shown.append(f"battery {self._readings['battery_v']:.1f} V")
        return " · ".join(shown) + "\n" + self.sketch()

    def _way_m(self) -> float:
        steps = np.diff(np.array(self.path).reshape(-1, 2), axis=0)
        return float(np.hypot(*steps.T).sum())

    def sketch(self) -> str:
        """The path as letters: o where it began, @ where the robot is, x the goals; as large as fits, north up."""
        points = np.array(self.path).reshape(-1, 2)
        if not len(points):
            return ""
        shown = np.vstack([points, self.goals_m])
        low, high = shown.min(axis=0), shown.max(axis=0)
        # A letter is about twice as high as wide.
        m_per_row = max((high[0] - low[0]) / (_WIDE - 1) * 2, (high[1] - low[1]) / (_HIGH - 1), _LEAST_M / _HIGH)
        canvas = [[" "] * _WIDE for _ in range(_HIGH)]
        for letter, places in (("·", points), ("x", self.goals_m), ("o", points[:1]), ("@", points[-1:])):
            for x_m, y_m in places:
                row, column = round((high[1] - y_m) / m_per_row), round((x_m - low[0]) / m_per_row * 2)
                canvas[min(row, _HIGH - 1)][min(column, _WIDE - 1)] = letter
        return "\n".join("  " + "".join(line).rstrip() for line in canvas).rstrip()
