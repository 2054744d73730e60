"""Clocks of single trials: fitted beside the numbers that all trials share, and whether they are needed."""
