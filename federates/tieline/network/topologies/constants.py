"""What topology files and drawings of them agree on."""

PREFIX = "CC_"
"""What the name of a control centre begins with, in every topology file."""

NS_PER_KM = 5_000
"""Optical fibre: ITU-T G.114, annex A."""
