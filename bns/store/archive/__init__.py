"""A whole study as one small file: what its figures and findings are counted from, one row a run."""
