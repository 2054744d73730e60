"""The next experiment: commands that discriminate between competing models."""
