"""Robots on two wheels: their drivers and their drive."""
