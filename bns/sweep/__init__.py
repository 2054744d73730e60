"""Sweeps: a YAML grid, its runs in order, the processes that carry them out, and the store they end in."""
