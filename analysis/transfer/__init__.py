"""Controllers of stored runs, driven in another world than theirs: a table and a figure."""
