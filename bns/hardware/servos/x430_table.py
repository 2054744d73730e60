"""The X series at 12 V: addresses, sizes, defaults and units as in the makers' e-manual (emanual.robotis.com/docs/en/dxl/x/,
pages XL430-W250, XM430-W350 and XM430-W210: control table and specifications).

Of what the table holds, these have other names there: `moving_speed` is Profile Velocity, `torque_limit` Goal PWM (in position
control "a final limiter on the output PWM value"), `present_load` Present PWM, `max_torque` PWM Limit, and the angle limits are
Min and Max Position Limit. A joint that is held by something has Present PWM at Goal PWM, on every model; the manual calls
Present Load an estimate from that, and the XM430 has a measured current instead, which falls with the supply.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from bns.hardware.servos.servo_table import Register, ServoTable

_POSITION = 4095
_PWM = 885
"""About 0.113 % each."""
_FREE = 2**32 - 1

REGISTERS: Mapping[str, Register] = {
    "model_number": Register(0, 2, 1060, 0xFFFF, False),
    "model_information": Register(2, 4, 0, _FREE, False),
    "firmware": Register(6, 1, 45, 255, False),
    "id": Register(7, 1, 1, 252),
    "baud_rate": Register(8, 1, 1, 7),
    "return_delay": Register(9, 1, 250, 254),
    "drive_mode": Register(10, 1, 0, 13),
    "operating_mode": Register(11, 1, 3, 16),
    "secondary_id": Register(12, 1, 255, 255),
    "protocol_type": Register(13, 1, 2, 2),
    "homing_offset": Register(20, 4, 0, _FREE, True, True),
    "moving_threshold": Register(24, 4, 10, 1023),
    "temperature_limit": Register(31, 1, 72, 100),
    "high_voltage_limit": Register(32, 2, 140, 160),
    "low_voltage_limit": Register(34, 2, 60, 160),
    "max_torque": Register(36, 2, _PWM, _PWM),
    "velocity_limit": Register(44, 4, 265, 1023),
    "ccw_angle_limit": Register(48, 4, _POSITION, _POSITION),
    "cw_angle_limit": Register(52, 4, 0, _POSITION),
    "alarm_shutdown": Register(63, 1, 52, 255),
    "torque_enable": Register(64, 1, 0, 1),
    "led": Register(65, 1, 0, 1),
    "status_return": Register(68, 1, 2, 2),
    "registered": Register(69, 1, 0, 1, False),
    "hardware_error": Register(70, 1, 0, 255, False),
    "bus_watchdog": Register(98, 1, 0, 127),
    "torque_limit": Register(100, 2, _PWM, _PWM, True, True),
    "goal_velocity": Register(104, 4, 0, _FREE, True, True),
    "profile_acceleration": Register(108, 4, 0, 32767),
    "moving_speed": Register(112, 4, 0, 32767),
    "goal_position": Register(116, 4, 2048, _POSITION),
    "realtime_tick": Register(120, 2, 0, 32767, False),
    "moving": Register(122, 1, 0, 1, False),
    "moving_status": Register(123, 1, 0, 255, False),
    "present_load": Register(124, 2, 0, 0xFFFF, False, True),
    "load_or_current": Register(126, 2, 0, 0xFFFF, False, True),
    "present_speed": Register(128, 4, 0, _FREE, False, True),
    "present_position": Register(132, 4, 2048, _FREE, False, True),
    "velocity_trajectory": Register(136, 4, 0, _FREE, False, True),
    "position_trajectory": Register(140, 4, 2048, _FREE, False, True),
    "present_voltage": Register(144, 2, 120, 0xFFFF, False),
    "present_temperature": Register(146, 1, 30, 255, False),
}

ALARMS: Mapping[int, str] = {
    0: "voltage out of its limits",
    2: "overheated",
    3: "its encoder fails",
    4: "electrical shock, or too little power for its motor",
    5: "overload",
}
"""Bit of the register Hardware Error Status -> what it says. What shut a servo down stays until it is rebooted."""
REFUSALS: Mapping[int, str] = {
    1: "the instruction failed",
    2: "unknown instruction",
    3: "checksum",
    4: "value out of range",
    5: "value too short",
    6: "value beyond a limit",
    7: "no access to that register",
}
"""Number in a status packet's error byte -> what it says (e-manual, Protocol 2.0, Status Packet)."""
_MINUTE = 2.0 * math.pi / 60.0

XL430_W250 = ServoTable(
    model="XL430-W250",
    number=1060,
    protocol=2,
    registers=REGISTERS,
    centre=2048,
    rad_per_step=2.0 * math.pi / 4096,
    rad_s_per_step=0.229 * _MINUTE,
    full_torque=_PWM,
    no_load_rad_s=61 * _MINUTE,
    volts=(6.5, 12.0),
    new_baud=57_600,
    bauds={
        1_000_000: 3,
        57_600: 1,
        115_200: 2,
        2_000_000: 4,
        3_000_000: 5,
        4_000_000: 6,
        4_500_000: 7,
        9_600: 0,
    },
    wanted={
        "status_return": 2,
        "return_delay": 0,
        "drive_mode": 0,
        "operating_mode": 3,
        "cw_angle_limit": 0,
        "ccw_angle_limit": _POSITION,
    },
    needed=("status_return", "drive_mode", "operating_mode"),
    alarms=ALARMS,
    still_steps=3,
    locked_below=64,
    alarm_bits=0x80,
    garbled_number=3,
    refusals=REFUSALS,
)
"""Drive mode 0: profiles of speed, forward, and no torque that comes on with a goal. Operating mode 3: position control."""


def _xm(model: str, number: int, no_load_rev_min: float, velocity_limit: int) -> ServoTable:
    changed = {
        "model_number": REGISTERS["model_number"]._replace(default=number),
        "temperature_limit": REGISTERS["temperature_limit"]._replace(default=80),
        "high_voltage_limit": REGISTERS["high_voltage_limit"]._replace(default=160),
        "low_voltage_limit": REGISTERS["low_voltage_limit"]._replace(default=95),
        "velocity_limit": REGISTERS["velocity_limit"]._replace(default=velocity_limit),
    }
    return replace(
        XL430_W250,
        model=model,
        number=number,
        registers={**REGISTERS, **changed},
        no_load_rad_s=no_load_rev_min * _MINUTE,
        volts=(10.0, 14.8),
    )


XM430_W350 = _xm("XM430-W350", 1020, 46.0, 200)
XM430_W210 = _xm("XM430-W210", 1030, 77.0, 330)
X430 = (XL430_W250, XM430_W350, XM430_W210)
"""No load at 12 V."""
