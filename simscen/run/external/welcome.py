"""How an external stack introduces itself."""

import json
from dataclasses import dataclass, field, replace
from typing import Any

from simscen.core.messages.goal_names import Mode
from simscen.peer import wire
from simscen.run.external.errors import NotAllowed
from simscen.run.external.topics import Offer

LONGEST_NAME = 200
LONGEST_ABOUT = 65_536


@dataclass(frozen=True)
class Welcome:
    """Its name and version, the topics it wants, when it wants to be asked, and what else it says of itself."""

    name: str = ""
    version: str = ""
    topics: tuple[str, ...] = ()
    every_beat: bool = False
    about: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, kind: int, body: bytes, offer: Offer, mode: Mode = "navigate_to_pose") -> "Welcome":
        """From its first frame. Raises Malformed, or NotAllowed, as of a stack that does not know the `mode`."""
        if kind != wire.WELCOME:
            raise NotAllowed("its first frame is no WELCOME")
        told = wire.from_json(body)
        if told.get("protocol") != wire.PROTOCOL:
            raise NotAllowed(f"it speaks version {told.get('protocol')} of the protocol, simscen {wire.PROTOCOL}")
        step = told.get("step", "control")
        if step not in ("control", "beat"):
            raise NotAllowed(f"`step` is {step!r}, neither `control` nor `beat`")
        modes = told.get("modes", ["navigate_to_pose"])
        if not isinstance(modes, list) or mode not in modes:
            known = ", ".join(map(str, modes))[:200] if isinstance(modes, list) else "none"
            raise NotAllowed(f"the scenario sends goals by {mode}, which this stack does not know; it knows {known}")
        topics = told.get("topics", [])
        if not isinstance(topics, list) or not all(isinstance(topic, str) for topic in topics):
            raise NotAllowed("`topics` is no list of names")
        if unknown := [topic for topic in topics if topic not in offer.says]:
            raise NotAllowed(f"it wants `{unknown[0][:80]}`, which there is not; there are {', '.join(offer.says)}")
        return cls(_text(told, "name"), _text(told, "version"), tuple(topics), step == "beat", _about(told))

    def with_farewell(self, body: bytes) -> "Welcome":
        """The same, with what it said at the end; what cannot be read changes nothing, as the run is over."""
        try:
            return replace(self, about=self.about | _about(wire.from_json(body)))
        except (NotAllowed, wire.Malformed):
            return self

    @property
    def facts(self) -> dict[str, str]:
        """For the log."""
        about = {"about": json.dumps(self.about, sort_keys=True)} if self.about else {}
        return {"name": self.name, "version": self.version, "protocol": str(wire.PROTOCOL), **about}


def _text(told: dict[str, Any], key: str) -> str:
    text = told.get(key, "")
    if not isinstance(text, str) or len(text) > LONGEST_NAME:
        raise NotAllowed(f"`{key}` is no text of at most {LONGEST_NAME} characters")
    return text


def _about(told: dict[str, Any]) -> dict[str, Any]:
    about = told.get("about", {})
    if not isinstance(about, dict) or len(str(about)) > LONGEST_ABOUT:
        raise NotAllowed(f"`about` is no object of at most {LONGEST_ABOUT} characters")
    return about
