"""What a guard did, in a file that another process writes: a disk that hangs must not hold up who stops a robot.

Standard library alone.
"""

from __future__ import annotations

import contextlib
import os
import time

_WRITTEN_S = 1.0
"""So long a guard that ends waits for its last lines to be written."""
_LOOKS_S = 0.005
_WRITER = 'IFS= read -r line && { printf "%s\\n" "$line"; exec cat; } >> "$0"'
"""There is no file before there is a line."""


class Notes:
    """Lines appended to ``file``, or to none. Each costs no more than a write into a pipe, and is lost where that is full.

    The program that writes begins here, while nothing hurries, and ends when the pipe is closed, by whatever.
    """

    def __init__(self, file: str | None) -> None:
        self._pipe, self._writer = -1, 0
        if file is not None:
            with contextlib.suppress(OSError):  # a guard without notes is better than none
                self._begin(file)

    def _begin(self, file: str) -> None:
        far, near = os.pipe()
        try:
            command = ["/bin/sh", "-c", _WRITER, file]
            self._writer = os.posix_spawn(command[0], command, os.environ, file_actions=[(os.POSIX_SPAWN_DUP2, far, 0)])
        except OSError:
            os.close(near)
            raise
        finally:
            os.close(far)
        os.set_blocking(near, False)
        self._pipe = near

    def write(self, line: bytes) -> None:
        """Hand a line on; it ends in a line feed."""
        with contextlib.suppress(OSError):
            if self._pipe >= 0:
                os.write(self._pipe, line)

    def close(self) -> None:
        """No more lines; waits a little for the last ones."""
        if self._pipe < 0:
            return
        os.close(self._pipe)
        self._pipe = -1
        end_s = time.monotonic() + _WRITTEN_S
        with contextlib.suppress(OSError):
            while not os.waitpid(self._writer, os.WNOHANG)[0] and time.monotonic() < end_s:
                time.sleep(_LOOKS_S)
