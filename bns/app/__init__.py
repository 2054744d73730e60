"""`bns explore`: the same functions as the command line's, with switches and pictures, in a browser on this machine."""
