"""Where the points of a sweep run: on this machine, or on the workers of a Dask cluster."""
