"""Files that nobody would write, for every reader of users' files: `make fuzz`."""
