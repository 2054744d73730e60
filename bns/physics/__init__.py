"""Differential drive with named physical effects, one file each in `effects`."""
