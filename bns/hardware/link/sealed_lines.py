"""Lines of a log that each carry a number and a checksum, so that none can be changed, lost, doubled or exchanged unseen.

A line of JSON ends with ``"n":NUMBER,"crc":"8 hexadecimal digits"}``. The CRC-32 is that of the checksum before it and of all of
the line that stands before its own; the first one begins with the CRC-32 of whatever stands above it, which is older lines
without checksums, or nothing.
"""

from __future__ import annotations

import re
import shlex
import warnings
import zlib
from pathlib import Path

from bns.errors import HardwareError

_SEAL = re.compile(rb',"n":(\d{1,15}),"crc":"([0-9a-f]{8})"\}')


class LogWarning(UserWarning):
    """A log cannot be checked; the message names it."""


class Seals:
    """Numbers and checksums of the lines to come after ``above``, what a log already holds."""

    def __init__(self, above: bytes = b"") -> None:
        lines = above.splitlines(keepends=True)
        last = _sealed(lines[-1].rstrip(b"\n")) if lines else None
        self._number = last[0] if last else len(lines)
        self._crc = last[1] if last else zlib.crc32(above)

    def line(self, event: str) -> str:
        """``event``, a JSON object without spaces, as the next line."""
        self._number += 1
        body = f'{event[:-1]},"n":{self._number}'
        self._crc = _crc(self._crc, body.encode())
        return f'{body},"crc":"{self._crc:08x}"}}\n'


def checked_lines(path: Path, data: bytes) -> list[str]:
    """The whole lines of a log, in order; a last one without an end is passed over.

    HardwareError names the first line that is not as it was written. LogWarning if there are lines without checksums.
    """
    lines = data[: data.rfind(b"\n") + 1].split(b"\n")[:-1]
    unsealed = next((at for at, line in enumerate(lines) if b'"crc"' in line), len(lines))
    crc = zlib.crc32(b"".join(line + b"\n" for line in lines[:unsealed]))
    for number, line in enumerate(lines[unsealed:], unsealed + 1):
        crc = _followed(path, number, line, crc, unsealed)
    text = [_text(path, number, line, unsealed) for number, line in enumerate(lines, 1)]
    if unsealed:
        warnings.warn(
            f"{path}: lines 1 to {unsealed} were written before lines had checksums, so changes to them cannot be "
            "detected.",
            LogWarning,
            stacklevel=3,
        )
    return text


def _followed(path: Path, number: int, line: bytes, crc: int, unsealed: int) -> int:
    """The checksum of a line that must follow one with ``crc``; ``unsealed`` lines at the top have none of their own."""
    seal = _sealed(line)
    if seal is None:
        raise _wrong(path, number, "was changed", unsealed)
    if seal[0] > number:
        raise _wrong(path, number, f"is number {seal[0]}: lines before it are lost", unsealed)
    if seal[0] < number:
        raise _wrong(path, number, f"is number {seal[0]}: it is there twice, or lines changed places", unsealed)
    if _crc(crc, line[: line.rindex(b',"crc"')]) != seal[1]:
        above = ", or one above it" if number == unsealed + 1 > 1 else ""
        raise _wrong(path, number, f"was changed{above}", unsealed)
    return seal[1]


def _sealed(line: bytes) -> tuple[int, int] | None:
    at = line.rfind(b',"n":')
    match = _SEAL.fullmatch(line, at) if at >= 0 else None
    return (int(match[1]), int(match[2], 16)) if match else None


def _crc(before: int, body: bytes) -> int:
    return zlib.crc32(body, zlib.crc32(before.to_bytes(4, "little")))


def _text(path: Path, number: int, line: bytes, unsealed: int) -> str:
    try:
        return line.decode()
    except UnicodeDecodeError as error:
        raise _wrong(path, number, "is no text", unsealed) from error


def _wrong(path: Path, number: int, what: str, unsealed: int) -> HardwareError:
    checked = number - 1 > unsealed  # the line before it is as it was written, and so are all above that
    below = (
        f" Everything above it can be resumed: head -n {number - 1} {shlex.quote(str(path))} > FILE, in its place, once the "
        "measurements.csv beside it is moved away."
        if checked
        else ""
    )
    return HardwareError(f"line {number} of {path} {what}. Take the file from a copy, unedited.{below}")
