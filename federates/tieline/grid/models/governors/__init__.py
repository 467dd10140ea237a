"""Turbine governors, one model a file."""
