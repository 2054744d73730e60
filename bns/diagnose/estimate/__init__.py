"""Parameters by least squares, noise, cross-validation, paired tests."""
