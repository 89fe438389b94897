"""pytest plug-in: collects scenario files with one test item per run, and provides the fixture `simscen`."""

from argparse import ArgumentTypeError

OUT_OPTION = "simscen_out"
"""Name of the ini option for the output folder, and key of the folder in `workerinput` of pytest-xdist."""


def positive_number(text: str) -> int:
    """Convert the value of an option to a whole number. Raises ArgumentTypeError if it is not at least 1."""
    if not (text.isascii() and text.isdecimal() and int(text) > 0):
        raise ArgumentTypeError(f"{text!r} is not a whole number of at least 1")
    return int(text)
