"""Tests that the peer refuses frames of simscen that violate the stack protocol."""

import socket
from collections.abc import Callable

import pytest

from simscen.peer import wire
from simscen.peer.client import Peer
from simscen.peer.wire import Connection

HELLO = {"protocols": [1], "robot": {}, "says": [], "hears": []}


def receive(*frames: bytes) -> None:
    """Let a peer receive these frames until the connection ends or a frame is malformed."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        ours.sendall(b"".join(frames))
        for _ in Peer("p", connection=Connection(theirs)):
            pass


@pytest.mark.parametrize("hello", [{}, {**HELLO, "protocols": 1}, {**HELLO, "says": [{}]}, {**HELLO, "hears": None}])
def test_invalid_hello_is_malformed(hello: dict[str, object]) -> None:
    with pytest.raises(wire.Malformed, match="invalid content of HELLO"):
        receive(wire.json_frame(wire.HELLO, hello))


@pytest.mark.parametrize(
    ("name", "make"),
    [
        ("STEP", lambda: wire.step_frame(wire.StepHeader(0, 0, 0, 1000, 0), [(7, b"")])),
        ("GOAL", lambda: wire.json_frame(wire.GOAL, {})),
        ("GOAL", lambda: wire.json_frame(wire.GOAL, {"goals": [{"name": "a"}]})),
        ("PREEMPT", lambda: wire.json_frame(wire.PREEMPT, {"goal": None})),
        ("CANCEL", lambda: wire.json_frame(wire.CANCEL, {})),
    ],
)
def test_frame_with_invalid_content_is_malformed(name: str, make: Callable[[], bytes]) -> None:
    with pytest.raises(wire.Malformed, match=f"invalid content of {name}"):
        receive(wire.json_frame(wire.HELLO, HELLO), make())
