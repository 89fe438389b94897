"""How the adapter ends when it cannot go on."""


class Failure(Exception):
    """The run cannot go on; the message says what is wrong and who can mend it."""
