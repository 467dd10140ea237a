"""One experiment from its file to its result folder: check, plan, run, summarise, draw."""
