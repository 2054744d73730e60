"""Measurements of bodies on joints: cycles, set points, and the stretches that are predicted."""
