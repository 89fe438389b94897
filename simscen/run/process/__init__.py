"""Execute each run in a process of its own: supervisor, fork server, and workers."""
