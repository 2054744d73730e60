"""Drives once more: a journal replayed, a final controller repeated."""
