"""Files of a store: names, parquet with digests, journals, locks, and whether a part is whole."""
