"""pytest plug-in: collects scenario files with one test item per run, and provides the fixture `simscen`."""

OUT_OPTION = "simscen_out"
"""Name of the setting for the output folder, in the configuration of pytest and in the input of xdist workers."""
