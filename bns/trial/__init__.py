"""Trials: a run whose world is a robot."""
