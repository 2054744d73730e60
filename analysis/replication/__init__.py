"""The page that says, finding by finding, what of the dissertation replicates: ``python -m analysis.replication``."""
