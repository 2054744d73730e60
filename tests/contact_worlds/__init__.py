"""Robots simulated with contact, each with something hidden, and the logs that a lab would have of them.

``catalogue`` lists the worlds and writes their files, ``simulation`` runs the trials, ``robots`` builds the bodies.
"""
