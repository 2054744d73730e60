"""Why the first run on a machine waits."""

from __future__ import annotations

import sys

from bns.spec import RunSpec


def say_if_compiling(*specs: RunSpec, always: bool = False) -> None:
    """One line on stderr, where that is a terminal (or ``always``) and kernels of these specs are not compiled yet."""
    from bns.engine.jit import compiled

    if (always or sys.stderr.isatty()) and not all(compiled(spec.robot, spec.world) for spec in specs):
        print("bns: compiling the kernels, once on this machine (about 20 s)", file=sys.stderr)
