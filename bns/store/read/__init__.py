"""What reads a store: a snapshot of its parts, views, queries, tables."""
