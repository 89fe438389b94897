"""How a run with an external stack can fail; kinds of RunError, and of errors in JUnit."""

TIMEOUT = "stack-timeout"
"""No answer within its limit of wall time."""
CRASHED = "stack-crashed"
"""The process has ended, could not be started, or has hung up."""
PROTOCOL = "stack-protocol"
"""What it said is not what the protocol allows."""
FAILED = "stack-failed"
"""It said itself that it cannot go on."""


class NotAllowed(ValueError):
    """What a stack said is not what the protocol allows; the message says what, without who and when."""
