"""One process for each run: supervisor, fork server, and worker processes."""
