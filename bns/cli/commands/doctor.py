"""What `bns doctor` was asked for."""

from __future__ import annotations

import argparse

from bns.hardware.clock import RealClock
from bns.hardware.doctor import examine
from bns.hardware.rig import load_rig
from bns.registry import PLATFORMS


def checked_up(options: argparse.Namespace) -> int:
    """Print the findings; 0 if all is fine, else 2."""
    if options.robot is not None:
        PLATFORMS.part(options.robot)  # there is no robot without: a misspelled name must not be "all fine"
    rig = None if options.rig is None else load_rig(options.rig, options.robot)
    bad = 0
    for finding in examine(rig, RealClock()):
        print(finding, flush=True)
        bad += not finding.fine
    fine = "all fine" if rig is not None else "all fine at this computer; no robot and no tracker was checked: give --rig FILE"
    print(fine if not bad else f"{bad} to be fixed")
    return 2 if bad else 0
