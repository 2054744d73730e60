"""Speed: every claim is a ratio against a named peer, or a distance from a floor, measured in this very run.

`python -m tests.bench` prints the table. Nothing here is collected by pytest, and no test depends on time.
"""
