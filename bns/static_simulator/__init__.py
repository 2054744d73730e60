"""Simulators trained once from random commands, and trials of controllers evolved on them."""
