"""Which code, on which machine, made a result."""

from __future__ import annotations

import importlib.metadata
import json
import platform
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import bns

_LIBRARIES = ("numpy", "numba", "torch", "pandas", "pyarrow", "duckdb")
_GIT_TIMEOUT_S = 10.0


@dataclass(frozen=True)
class Provenance:
    """Git commit and whether its tree was clean ("" and None outside a checkout), versions, host."""

    git_sha: str
    git_clean: bool | None
    bns_version: str
    host: str
    versions: str

    def columns(self) -> dict[str, Any]:
        """The provenance columns of the runs table."""
        return {
            "git_sha": self.git_sha,
            "git_clean": self.git_clean,
            "bns_version": self.bns_version,
            "host": self.host,
            "versions": self.versions,
        }


@cache
def provenance() -> Provenance:
    """Provenance of this process, found out once; never fails."""
    sha, clean = git_state(Path(bns.__file__).resolve().parent)
    libraries = {name: version(name) for name in _LIBRARIES}
    versions = json.dumps({"python": platform.python_version(), **libraries}, sort_keys=True)
    return Provenance(sha, clean, version("bns"), platform.node(), versions)


def git_state(package: Path) -> tuple[str, bool | None]:
    """Commit of the checkout that tracks ``package`` and whether it is unchanged; else ("", None)."""
    # A package installed below somebody else's checkout lies in a git tree that says nothing about it.
    if _git(package, "ls-files", "--error-unmatch", "__init__.py") is None:
        return "", None
    sha, changes = _git(package, "rev-parse", "HEAD"), _git(package, "status", "--porcelain")
    return (sha, None if changes is None else changes == "") if sha else ("", None)


def _git(folder: Path, *arguments: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *arguments], capture_output=True, text=True, timeout=_GIT_TIMEOUT_S, check=False
        )
    except (OSError, subprocess.SubprocessError, UnicodeDecodeError):
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def version(package: str) -> str:
    """Installed version of a package; "" if it is not installed."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return ""
