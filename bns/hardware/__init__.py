"""Robots as they are: links, drivers, trackers, safety, and emulators that answer at the level of bytes."""
