"""pytest plug-in: collects scenario files with one test item per run, and provides the fixture `simscen`."""

OUT_OPTION = "simscen_out"
"""Name of the ini option for the output folder, and key of the folder in `workerinput` of pytest-xdist."""
