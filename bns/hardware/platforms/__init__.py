"""Robots on their rigs, one module each: driver, tracker and safety brought together. Found by name."""
