"""Does the diagnosis name what a snake hides? Bodies written a second time, each hiding something; asked by the command line.

Nothing here imports the package's body, servos or effects: geometry, steps, integrator, servos and what is hidden are others.
"""
