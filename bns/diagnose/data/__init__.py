"""Measurements: how they are read, mapped, checked and cut into tracks."""
