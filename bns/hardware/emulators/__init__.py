"""What stands in for hardware: the bytes of a device, with state, time and faults. Drivers never know."""
