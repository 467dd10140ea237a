"""The federation: what crosses it, when, and over what; the only package that imports HELICS."""
