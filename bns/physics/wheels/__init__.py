"""Wheeled robots in physics: equations of motion, integration, and a second integrator to compare with."""
