"""A lock that many may hold together, on the file that one alone locks to keep all of them out."""

from __future__ import annotations

import errno
import os
import warnings
from pathlib import Path
from types import ModuleType

from bns.store.disk.files import StoreWarning, explained, make_folder

fcntl: ModuleType | None
try:
    import fcntl
except ModuleNotFoundError:  # Windows
    fcntl = None

_HELD = {errno.EACCES, errno.EAGAIN, errno.EWOULDBLOCK}
_NO_LOCKS = {errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.ENOLCK}


class SharedLock:
    """A shared ``flock`` on ``path``, of the kind that excludes the exclusive one of ``filelock.FileLock``.

    Not `filelock.ReadWriteLock`, which is a transaction on an SQLite database: its byte-range locks do not see those of
    ``FileLock`` on the same file, and SQLite does not vouch for them on network file systems. Nor its
    ``SoftReadWriteLock``, whose shares outlive a killed process until a clock says that they are stale. Where there is
    no ``flock`` (Windows), shards go without, as on a file system that has none.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._descriptor = path, -1
        self.is_supported = True

    def acquire(self) -> bool:
        """Take a share at once; False if somebody holds the file alone.

        On a file system without locks there is a StoreWarning, ``is_supported`` is False and the answer True.
        """
        make_folder(self._path.parent)
        if fcntl is None:
            self._go_without("this system has no shared file locks")
            return True
        with explained("lock", self._path):
            self._descriptor = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                fcntl.flock(self._descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except OSError as error:
                self.release()
                if error.errno in _HELD:
                    return False
                if error.errno not in _NO_LOCKS:
                    raise
                self._go_without(f"the file system of {self._path.parent} has no file locks")
        return True

    @property
    def is_free(self) -> bool:
        """Whether a share could be had now; False where nobody can tell."""
        if fcntl is None:
            return False
        free = self.acquire()
        self.release()
        return free

    def release(self) -> None:
        """Give the share back; without effect if it is not held."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
        self._descriptor = -1

    def _go_without(self, why: str) -> None:
        self.is_supported = False
        warnings.warn(
            f"{why}: nothing prevents a second process from running "
            "the same shard again (every run still counts once), and bns compact must wait until all shards "
            "have ended.",
            StoreWarning,
            stacklevel=5,
        )
