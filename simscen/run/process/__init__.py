"""One process for each run: what starts it, hears it, ends it, and tells what became of it."""
