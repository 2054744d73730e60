"""The link to a robot: serial ports, reply times, and the log of what was said."""
