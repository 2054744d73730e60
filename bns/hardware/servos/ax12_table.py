"""The AX-12: addresses, sizes, defaults and units as in its manual."""

from __future__ import annotations

import math
from collections.abc import Mapping

from bns.hardware.servos.servo_table import Register, ServoTable

REGISTERS: Mapping[str, Register] = {
    "model_number": Register(0, 2, 12, 0xFFFF, False),
    "firmware": Register(2, 1, 24, 255, False),
    "id": Register(3, 1, 1, 253),
    "baud_rate": Register(4, 1, 1, 254),
    "return_delay": Register(5, 1, 250, 254),
    "cw_angle_limit": Register(6, 2, 0, 1023),
    "ccw_angle_limit": Register(8, 2, 1023, 1023),
    "temperature_limit": Register(11, 1, 70, 150),
    "low_voltage_limit": Register(12, 1, 60, 250),
    "high_voltage_limit": Register(13, 1, 140, 250),
    "max_torque": Register(14, 2, 1023, 1023),
    "status_return": Register(16, 1, 2, 2),
    "alarm_led": Register(17, 1, 36, 127),
    "alarm_shutdown": Register(18, 1, 36, 127),
    "torque_enable": Register(24, 1, 0, 1),
    "led": Register(25, 1, 0, 1),
    "cw_margin": Register(26, 1, 1, 255),
    "ccw_margin": Register(27, 1, 1, 255),
    "cw_slope": Register(28, 1, 32, 255),
    "ccw_slope": Register(29, 1, 32, 255),
    "goal_position": Register(30, 2, 512, 1023),
    "moving_speed": Register(32, 2, 0, 1023),
    "torque_limit": Register(34, 2, 1023, 1023),
    "present_position": Register(36, 2, 512, 1023, False),
    "present_speed": Register(38, 2, 0, 2047, False, True),
    "present_load": Register(40, 2, 0, 2047, False, True),
    "present_voltage": Register(42, 1, 120, 255, False),
    "present_temperature": Register(43, 1, 30, 255, False),
    "registered": Register(44, 1, 0, 1, False),
    "moving": Register(46, 1, 0, 1, False),
    "lock": Register(47, 1, 0, 1),
    "punch": Register(48, 2, 32, 1023),
}

ERRORS: Mapping[int, str] = {
    0: "voltage out of its limits",
    1: "goal beyond the angle limits",
    2: "overheated",
    3: "value out of range",
    4: "checksum",
    5: "overload",
    6: "unknown instruction",
}
"""Bit of a status packet's error byte -> what it says."""
VOLTAGE, ANGLE, OVERHEAT, RANGE, CHECKSUM, OVERLOAD, INSTRUCTION = (1 << bit for bit in range(7))

RAD_PER_STEP = 5.235987755982989 / 1023
"""300 degrees over 1023 steps."""
CENTRE = 512
RAD_S_PER_STEP = 0.111 * 2 * math.pi / 60
"""A unit of moving_speed is 0.111 turns a minute; 0 stands for no limit at all."""

AX12 = ServoTable(
    model="AX-12",
    number=12,
    protocol=1,
    registers=REGISTERS,
    centre=CENTRE,
    rad_per_step=RAD_PER_STEP,
    rad_s_per_step=RAD_S_PER_STEP,
    full_torque=1023,
    no_load_rad_s=59 * 2 * math.pi / 60,
    volts=(9.0, 12.0),
    new_baud=1_000_000,
    bauds={
        1_000_000: 1,
        500_000: 3,
        400_000: 4,
        250_000: 7,
        200_000: 9,
        115_200: 16,
        57_600: 34,
        19_200: 103,
        9_600: 207,
    },
    wanted={"return_delay": 0, "status_return": 2, "cw_angle_limit": 0, "ccw_angle_limit": 1023},
    needed=("status_return",),
    alarms=ERRORS,
    garbled_bit=CHECKSUM,
    minus_bit=1024,
)
"""No load: 59 turns a minute at 12 V."""


def errors_in(byte: int) -> list[str]:
    """What an error byte says."""
    return [text for bit, text in ERRORS.items() if byte & (1 << bit)]
