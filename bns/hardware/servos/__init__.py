"""Servos: their registers, the bus, the bridge, and the drive of a snake."""
