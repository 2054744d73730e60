"""`bns calibrate --delay`: the robot moves to and fro on its rig, and how late its tracker is comes out."""

from __future__ import annotations

from bns.errors import HardwareError
from bns.hardware.delay import Delay, delay_between
from bns.hardware.safety import Stopping
from bns.hardware.tracking.kinds import delay_of
from bns.trial.session import TrialSetup, open_rig

SECONDS = 15.0
_WHEELS = "turn on the spot, a third of a turn each way,"
_SNAKE = "straighten, then bend to one side and back"


def measured_delay(how: TrialSetup, seconds: float = SECONDS, seed: int = 0) -> Delay:
    """Move for so long, guarded like a trial; HardwareError, TrialPausedError, StopNotConfirmedError."""
    with Stopping() as stopping, open_rig(how, seed, None, stopping) as opened:
        move_about = getattr(opened.platform, "move_about", None)
        if move_about is None:
            raise HardwareError(
                f"the robot {how.rig.robot} has no motion to measure a delay with; its platform needs move_about(seconds)."
            )
        if not (how.yes or how.emulated):
            what = _SNAKE if how.rig.robot == "snake" else _WHEELS
            try:
                stopping.ask(f"The robot will {what} for {seconds:g} s; Enter: ")
            except EOFError as error:
                raise HardwareError(
                    "there is nobody to ask before the robot moves: the input has ended. Run it at a terminal."
                ) from error
        return delay_between(move_about(seconds), delay_of(how.rig.tracker))


def in_words(found: Delay) -> str:
    """For the terminal."""
    return (
        f"the tracker's poses are {1000 * found.delay_s:.1f} ms old when they are stamped (standard error "
        f"{1000 * found.error_s:.1f} ms, correlation {found.correlation:.4f}, {found.sights} sights, {found.readings} readings "
        f"of its joints or encoders)\nwrite this into the rig's tracker:\n  delay_s: {found.delay_s:.4f}"
    )
