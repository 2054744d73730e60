"""The log of a tab: what its columns mean, what is odd about it, and what of it takes part."""
