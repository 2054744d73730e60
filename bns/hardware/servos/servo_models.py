"""The servos that a chain can be made of, by name and by number."""

from __future__ import annotations

from collections.abc import Mapping

from bns.hardware.servos.ax12_table import AX12
from bns.hardware.servos.servo_table import ServoTable
from bns.hardware.servos.x430_table import X430

TABLES: Mapping[str, ServoTable] = {table.model: table for table in (AX12, *X430)}
"""Model -> its table."""
OTHERS = {18: "AX-18", 300: "AX-12W"}
"""Numbers of models that are known, and of no use here."""
_BY_NUMBER = {(table.protocol, table.number): table for table in TABLES.values()}


def table_of(protocol: int, number: int) -> ServoTable | None:
    """The table of the model that answers with this number, if there is one."""
    return _BY_NUMBER.get((protocol, number))


def name_of(protocol: int, number: int) -> str:
    """The model that answers with this number."""
    table = table_of(protocol, number)
    return table.model if table is not None else OTHERS.get(number, f"number {number}")
