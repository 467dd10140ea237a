"""Topologies of the packet network: generated, imported, checked and drawn."""
