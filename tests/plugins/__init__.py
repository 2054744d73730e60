"""Parts that packages outside the tree bring."""
