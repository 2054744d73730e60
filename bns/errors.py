"""The errors a user can cause or meet. Every message names what was given, what is allowed, what to do next."""

from __future__ import annotations

import errno
from collections.abc import Iterable, Mapping
from difflib import get_close_matches


class BnsError(Exception):
    """An error with an explanation: the command line prints it without a traceback and exits with 2."""

    exit_code = 2


class SpecError(BnsError):
    """A run or sweep that cannot be carried out as written."""


class StoreError(BnsError):
    """Results that cannot be read, written or understood."""


class ModelError(BnsError):
    """A robot model, network file or table of measurements that cannot be used."""


class EffectError(ModelError):
    """An effect of the user's own whose Python fails, or returns what is no signal: a mistake, whatever its numbers are."""


class HardwareError(BnsError):
    """A port, robot, camera, calibration or plan of a trial that cannot be used; nothing has moved."""


class TrialPausedError(BnsError):
    """A trial that stopped with the robot confirmed still, and can be resumed."""

    exit_code = 3


class StopNotConfirmedError(BnsError):
    """A robot that may still be moving."""

    exit_code = 4


class TrialFileError(BnsError):
    """A file of a trial that cannot be written; the robot is confirmed to stand still, and the trial can be resumed."""

    exit_code = 5

    @classmethod
    def of(cls, path: object, error: Exception) -> TrialFileError:
        """That ``path`` could not be written because of ``error``, and what to do."""
        full = getattr(error, "errno", None) in _FULL
        return cls(f"cannot write {path}: {getattr(error, 'strerror', None) or error}. {_STANDS} {_FREE if full else _GO_ON}")

    @classmethod
    def after(cls, error: Exception) -> TrialFileError:
        """What went wrong with a file once the robot had been driven; ``error`` names it."""
        return cls(f"{error} {_STANDS} {_FREE}")


_STANDS = "The robot stands still; earlier evaluations are in the journal."
_FULL = {errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)}
_FREE = "Free some space, then continue with --resume."
_GO_ON = "Correct that, then continue with --resume."


class ClusterError(BnsError):
    """Other machines that cannot be used as asked: a scheduler, its workers, a batch system."""


class DeviceError(BnsError):
    """A GPU that is missing, cannot be used, or failed."""


class DataError(BnsError):
    """Measurements that cannot be used as they are."""


class SweepWarning(UserWarning):
    """A sweep goes on, but most likely not as it is meant."""


def in_both(typed: str, python: str) -> str:
    """How a user says something on the command line, and in Python: a message does not know from where it was asked for."""
    return f"{typed} (in Python: {python})"


def one_slip(given: str, name: str) -> bool:
    """Whether ``given`` is ``name`` but for capitals, or one letter too many, left out, wrong or swapped with the next one."""
    short, long = sorted((given.lower(), name.lower()), key=len)
    if short == long:
        return given != name
    if len(short) == len(long):
        wrong = [at for at in range(len(long)) if short[at] != long[at]]
        swapped = wrong == [wrong[0], wrong[0] + 1] and short[wrong[0] : wrong[0] + 2] == long[wrong[0] : wrong[0] + 2][::-1]
        return len(wrong) == 1 or swapped
    return any(long[:at] + long[at + 1 :] == short for at in range(len(long)))


def unknown_name(kind: str, given: object, valid: Iterable[str], also: Mapping[str, str] | None = None) -> str:
    """Say that ``given`` is no ``kind``, which one was probably meant, and list the valid names.

    A name that differs in upper and lower case alone is meant before all others. ``also``: other words for valid names, by which
    somebody may have called them.
    """
    names, words = sorted(valid), dict(also or {})
    same = [one for one in names if one.lower() == str(given).lower()]
    near = same[:1] or [words.get(one, one) for one in get_close_matches(str(given).lower(), [*words, *names], n=1, cutoff=0.5)]
    near = near or get_close_matches(str(given), names, n=1, cutoff=0.5)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    return f"unknown {kind} {given!r}.{hint} Valid: {', '.join(names)}."
