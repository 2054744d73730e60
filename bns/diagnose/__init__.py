"""Measurements against a model: compare them, find which physical effect is missing, add it, see the error fall."""
