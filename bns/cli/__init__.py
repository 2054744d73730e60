"""The command line: parse, call a function of the library, print."""
