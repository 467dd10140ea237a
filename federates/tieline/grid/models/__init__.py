"""Device models: equations, parameters and sources, one model a file."""
