"""A sweep file read and expanded into its runs: YAML to grid, combinations, order of seeds, shards."""
