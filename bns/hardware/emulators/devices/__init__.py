"""Emulated devices that speak the bytes of the real ones."""
