"""A sweep that stops when its best combinations are known."""
