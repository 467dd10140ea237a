"""Synchronous machines, one model a file."""
