"""What the system raises where a line has gone: `termios.error`, which is no OSError, where there is such a thing."""

from __future__ import annotations

TerminalError: type[Exception]
try:
    import termios
except ModuleNotFoundError:  # Windows: pyserial raises its own
    TerminalError = OSError
else:
    TerminalError = termios.error
