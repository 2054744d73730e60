"""Robots on a GPU, one module each, found by the robot's name: its rollout, and its substitute world with what is judged."""
