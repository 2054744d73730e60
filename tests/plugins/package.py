"""The package of docs/extending.md, written to a folder as an installer would."""

import re
import tomllib
from pathlib import Path

PAGE = (Path(__file__).parents[2] / "docs" / "extending.md").read_text()


def blocks():
    """File name -> content of every block of the page that begins with its file's name."""
    found = re.findall(r"^```(?:python|yaml|toml)\n# (\S+)\n(.*?)^```$", PAGE, flags=re.S | re.M)
    return dict(found)


def entry_points():
    """Group -> name -> what it leads to, as the page's pyproject.toml has them."""
    return tomllib.loads(blocks()["pyproject.toml"])["project"]["entry-points"]


def announce(folder, name, groups):
    """Beside modules in ``folder``: what pip writes when a package with these entry points is installed."""
    info = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = [line for group, parts in groups.items() for line in (f"[{group}]", *(f"{k} = {v}" for k, v in parts.items()))]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")


def install(folder):
    """The package of the page, in ``folder``."""
    for name, content in blocks().items():
        if name != "pyproject.toml":
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(content)
    (folder / "rover_parts" / "__init__.py").write_text("")
    announce(folder, "rover-parts", entry_points())
