"""Content of the frame WELCOME, with which an external stack answers HELLO."""

import json
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Any

from simscen.core.messages.goals import Mode
from simscen.peer import wire
from simscen.run.external.protocol import ProtocolViolation

MAX_NAME_LENGTH = 200
"""Maximum number of characters of `name` and of `version`."""
MAX_ABOUT_LENGTH = 1 << 20
"""Maximum number of characters of `about`."""
MAX_FIRST_ANSWER_S = 3700
"""Largest value of `first_answer_limit` and `first_answer_until` in s."""


@dataclass(frozen=True)
class Welcome:
    """Content of WELCOME, the first frame of a stack.

    Attributes:
        name: Name of the stack.
        version: Version of the stack.
        topics: Names of the topics to send to the stack.
        every_beat: Whether the stack must answer at each tick with messages, not only when a command is due.
        about: Additional information from the stack for the log.
        first_answer_limit: Maximum wall time in s for the first answer. It applies if it is longer than
            `answer_limit`.
        first_answer_until: Simulated time in s until which `first_answer_limit` applies to all answers.
    """

    name: str = ""
    version: str = ""
    topics: tuple[str, ...] = ()
    every_beat: bool = False
    about: dict[str, Any] = field(default_factory=dict)
    first_answer_limit: float = 0.0
    first_answer_until: float = 0.0

    @classmethod
    def parse(cls, kind: int, body: bytes, available: Collection[str], mode: Mode = "navigate_to_pose") -> "Welcome":
        """Parse the first frame of a stack. Raises Malformed or ProtocolViolation.

        `available` are the names of the topics to which the stack can subscribe. `mode` is the navigation mode of the
        scenario, which the stack must support.
        """
        if kind != wire.WELCOME:
            raise ProtocolViolation("its first frame is not a WELCOME")
        content = wire.from_json(body)
        if content.get("protocol") != wire.PROTOCOL:
            raise ProtocolViolation(
                f"it uses protocol version {content.get('protocol')}, but simscen uses protocol version {wire.PROTOCOL}"
            )
        step = content.get("step", "control")
        if step not in ("control", "beat"):
            raise ProtocolViolation(f"`step` is {step!r}, neither `control` nor `beat`")
        modes = content.get("modes", ["navigate_to_pose"])
        if not isinstance(modes, list) or mode not in modes:
            supported = ", ".join(map(str, modes))[:200] if isinstance(modes, list) else "none"
            raise ProtocolViolation(
                f"the scenario sends goals by {mode}, which this stack does not support; it supports {supported}"
            )
        topics = content.get("topics", [])
        if not isinstance(topics, list) or not all(isinstance(topic, str) for topic in topics):
            raise ProtocolViolation("`topics` is not a list of names")
        if unknown := [topic for topic in topics if topic not in available]:
            raise ProtocolViolation(
                f"it requests the topic `{unknown[0][:80]}`, which does not exist; available: {', '.join(available)}"
            )
        return cls(
            name=_checked_text(content, "name"),
            version=_checked_text(content, "version"),
            topics=tuple(topics),
            every_beat=step == "beat",
            about=_checked_about(content),
            first_answer_limit=_checked_seconds(content, "first_answer_limit"),
            first_answer_until=_checked_seconds(content, "first_answer_until"),
        )

    def with_bye(self, body: bytes) -> "Welcome":
        """Return a copy with the `about` of a BYE frame added. Ignores an invalid frame."""
        try:
            return replace(self, about=self.about | _checked_about(wire.from_json(body)))
        except (ProtocolViolation, wire.Malformed):
            return self

    @property
    def facts(self) -> dict[str, str]:
        """Facts about the stack for the log header: name, version, protocol version, and `about` as JSON."""
        about = {"about": json.dumps(self.about, sort_keys=True)} if self.about else {}
        return {"name": self.name, "version": self.version, "protocol": str(wire.PROTOCOL), **about}


def _checked_text(content: dict[str, Any], key: str) -> str:
    text = content.get(key, "")
    if not isinstance(text, str) or len(text) > MAX_NAME_LENGTH:
        raise ProtocolViolation(f"`{key}` is not a text of at most {MAX_NAME_LENGTH} characters")
    return text


def _checked_seconds(content: dict[str, Any], key: str) -> float:
    seconds = content.get(key, 0.0)
    if not isinstance(seconds, int | float) or not 0 <= seconds <= MAX_FIRST_ANSWER_S:
        raise ProtocolViolation(f"`{key}` is not a number of seconds from 0 to {MAX_FIRST_ANSWER_S}")
    return float(seconds)


def _checked_about(content: dict[str, Any]) -> dict[str, Any]:
    about = content.get("about", {})
    if not isinstance(about, dict) or len(str(about)) > MAX_ABOUT_LENGTH:
        raise ProtocolViolation(f"`about` is not an object of at most {MAX_ABOUT_LENGTH} characters")
    return about
