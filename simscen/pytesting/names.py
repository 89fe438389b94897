"""Names that several parts of the plug-in use."""

OUT = "simscen_out"
"""The folder for logs: in the configuration, and as a worker of xdist is told it."""
