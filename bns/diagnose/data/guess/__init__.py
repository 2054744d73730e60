"""A first mapping for a log that has none: what names of columns, topics and files tell."""
