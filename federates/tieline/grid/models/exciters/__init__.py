"""Excitation systems, one model a file."""
