"""Whether a file can be written where a user wants it, asked before the work of which it is the result."""

from __future__ import annotations

import tempfile
from pathlib import Path


def obstacle(path: Path) -> str:
    """Why no file can be written there; empty if one can. Nothing is left behind.

    A file is really made in the folder, without a name where the system has such files: permissions do not tell of a disk that is
    read-only or full, nor of a folder in which nobody may make any.
    """
    folder = path.absolute().parent
    if path.is_dir():
        return "it is a folder"
    if not folder.is_dir():
        return f"there is no folder {path.parent}"
    try:
        with tempfile.TemporaryFile(dir=folder, prefix=".bns-"):
            return ""
    except OSError as error:
        return f"no file can be made in {path.parent} ({error.strerror})"
