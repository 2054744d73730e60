"""What the documentation site makes from the code when it is built: pages of effects, commands and Python names."""
