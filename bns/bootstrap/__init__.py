"""Bootstrapped Neuro-Simulation itself: the loop, and what it moves (population, networks, tables)."""
