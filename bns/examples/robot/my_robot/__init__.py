"""A robot of one's own for bns: robot, task, world, driver, emulator."""
