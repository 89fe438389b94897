"""Check that a log still has all recorded messages, by the message counts in its end record."""

from collections.abc import Mapping

from simscen.core.records.verdict import Evidence, LogCoverage
from simscen.record import log_header, topics

NO_COUNTS = "the log has no message counts: an older simscen wrote it, or its end was edited"
"""Reason why all evidence of a log may be incomplete."""

_EVENTS = frozenset(
    {Evidence.CONTACTS, Evidence.NAVIGATION, Evidence.ERROR_CODES, Evidence.PLANNING, Evidence.RECOVERIES}
) | {Evidence.DISTURBANCES, Evidence.OBJECTS}
"""Evidence (kinds of recorded information) in the events."""
_EVIDENCE: dict[str, frozenset[Evidence]] = {
    topics.TRUTH.name: frozenset({Evidence.TRUTH, Evidence.VELOCITY}),
    topics.CLEARANCE.name: frozenset({Evidence.CLEARANCE}),
    topics.BELIEF.name: frozenset({Evidence.BELIEF, Evidence.COVARIANCE}),
    topics.COMMAND.name: frozenset({Evidence.COMMANDS}),
    topics.PLAN.name: frozenset({Evidence.PLANS}),
    topics.EVENTS.name: _EVENTS,
    topics.TF.name: frozenset({Evidence.OBJECTS}),
}
"""Evidence that each topic contains."""


class MessageCounts:
    """Counts the messages of each topic, and compares the numbers with the end record of the log."""

    def __init__(self) -> None:
        self._topics: dict[int, str] = {}
        self._scans: set[str] = set()
        self._found: dict[str, int] = {}
        self._newest: dict[str, int] = {}
        self._expected: dict[str, int] | None = None

    def add_channel(self, channel: int, topic: str, message_type: str) -> None:
        """Add the channel with the ID `channel`. Several channels may have the same topic."""
        self._topics[channel] = topic
        if message_type == topics.SCAN_TYPE:
            self._scans.add(topic)

    def add_message(self, channel: int, time: int) -> None:
        """Count a message. Raises ValueError if the messages of a topic are not in the order of `time`."""
        topic = self._topics.get(channel, "")
        if time < self._newest.get(topic, time):
            raise ValueError(f"the messages of {topic or 'a topic'} are not in the order of time")
        self._newest[topic] = time
        self._found[topic] = self._found.get(topic, 0) + 1

    def set_expected(self, end: Mapping[str, str], robot: str = "") -> None:
        """Set the expected counts from the end record, for topics in the namespace of `robot` ("" for none)."""
        prefix = log_header.COUNT_PREFIX + (f"/{robot}" if robot else "")
        counts = {name: int(count) for name, count in end.items() if name.startswith(log_header.COUNT_PREFIX)}
        if counts:
            self._expected = {
                name.removeprefix(prefix): count for name, count in counts.items() if name.startswith(f"{prefix}/")
            }

    def coverage(self) -> LogCoverage:
        """Return the evidence that the log lacks because messages were removed after the recording.

        Evidence is missing if all messages of the topic were removed, and partial if some messages were removed. All
        evidence is partial if the log has no message counts.
        """
        if self._expected is None:
            return LogCoverage(partial=dict.fromkeys(Evidence, NO_COUNTS))
        missing: dict[Evidence, str] = {}
        partial: dict[Evidence, str] = {}
        for topic, count in self._expected.items():
            number = self._found.get(topic, 0)
            if number == count:
                continue
            is_scan = topic in self._scans or topic.endswith("scan")  # the type of a removed topic is unknown
            evidence = _EVIDENCE.get(topic, frozenset({Evidence.SCANS} if is_scan else ()))
            reasons = dict.fromkeys(evidence, f"{topic} holds {number} of {count} recorded messages")
            (partial if number else missing).update(reasons)
        return LogCoverage(missing, partial)
