"""The sweep files that come with the package, by name."""

from __future__ import annotations

from pathlib import Path

from bns.errors import SpecError, unknown_name
from bns.shipped import shipped_root


def shipped_sweeps() -> dict[str, Path]:
    """Name -> file, in alphabetical order."""
    root = shipped_root("sweeps")
    return {} if root is None else {file.stem: file for file in sorted((root / "sweeps").glob("*.yaml"))}


def sweep_file(given: str | Path) -> Path:
    """The file that is meant: a name without folder and suffix is that of a shipped sweep, everything else a path.

    Raises:
        SpecError: there is no shipped sweep of that name; or a folder has it.
    """
    path, known = Path(given), shipped_sweeps()
    if path.suffix or len(path.parts) != 1:
        return path
    if path.name not in known and path.is_dir():
        raise SpecError(f"{path} is a folder; give the sweep file in it: {path / 'NAME.yaml'}.")
    if path.name not in known:
        raise SpecError(f"{unknown_name('sweep', path.name, known)} A file of your own is given with its suffix: {path}.yaml.")
    return known[path.name]
