"""The Dynamixel SDK's port on a trial's clock: time-outs in its time, reads that sleep."""

from __future__ import annotations

import math
from collections.abc import Callable

from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.link.serial_link import open_port

with extra("robot"):
    from dynamixel_sdk import PortHandler

_SLICE_S = 0.002
_BITS_A_BYTE = 10.0


class ClockedPort(PortHandler):
    """The SDK's port, with time-outs on the trial's clock."""

    is_open: bool

    def __init__(self, port: str, clock: Clock) -> None:
        super().__init__(port)
        self._clock = clock
        self._silent: Callable[[], bool] = lambda: False
        self._late: Callable[[], bool] = lambda: False

    def setupPort(self, cflag_baud: int) -> bool:  # noqa: N802  # the SDK's name
        """Open it, alone: two that ask on one bus take each other's answers, and its torque off. HardwareError says who is there.

        A read sleeps until bytes are there: the SDK's own spins, and holds up whatever computes meanwhile.
        """
        if self.is_open:
            self.closePort()
        self.ser = open_port(self.port_name, cflag_baud, self._clock)
        self.ser.timeout = _SLICE_S
        self.is_open = True
        self.tx_time_per_byte = 1000.0 * _BITS_A_BYTE / cflag_baud
        return True

    def setPacketTimeout(self, packet_length: int) -> None:  # noqa: N802  # the SDK's name
        """As the SDK has it: the time of the bytes, twice the adapter's latency, and a little."""
        super().setPacketTimeout(packet_length)
        self._late = self._clock.in_vain(self.packet_timeout / 1000.0)

    def clearPort(self) -> None:  # noqa: N802  # the SDK's name
        """Throw away what came too late; the SDK's own only waits until everything is sent."""
        self.ser.reset_input_buffer()
        self._silent = self._clock.in_vain(math.inf)  # from before the question on: an answer can be quick

    def isPacketTimeout(self) -> bool:  # noqa: N802  # the SDK's name
        """Whether to give up."""
        if self._silent():
            self._clock.waited(self.packet_timeout / 1000.0)
            return True
        return self._late()
