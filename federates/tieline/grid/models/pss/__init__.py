"""Power system stabilisers, one model a file."""
