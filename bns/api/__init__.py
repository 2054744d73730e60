"""The Python front door: what `import bns` offers, one file a concern. The command line prints what these functions give."""
