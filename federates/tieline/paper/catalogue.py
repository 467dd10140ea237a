"""Every item, in the order of the page: the first need no run and are computed while runs go."""

from tieline.paper import (
    damping,
    g26_trip,
    miniwecc_modes,
    open_loop,
    tables,
    two_area_modes,
    two_area_trip,
)
from tieline.paper.item import Item

ITEMS: tuple[Item, ...] = (
    two_area_modes.PLAIN,
    two_area_modes.BETA1,
    two_area_modes.BETA2,
    miniwecc_modes.PLAIN,
    miniwecc_modes.BETA1,
    miniwecc_modes.BETA2,
    open_loop.WEIGHTS,
    open_loop.DELAY,
    open_loop.ZEROS,
    tables.TUNINGS,
    two_area_trip.BETA1,
    two_area_trip.BETA2,
    two_area_trip.LOADS,
    g26_trip.BETA1,
    g26_trip.BETA2,
    g26_trip.TUNINGS,
    damping.DAMPING,
    tables.FORMS_TABLE,
)
