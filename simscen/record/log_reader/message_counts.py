"""Comparison of the messages in a log with the counts that the recorder wrote at its end."""

from collections.abc import Mapping

from simscen.core.records.verdict import Evidence, LogCoverage
from simscen.record import log_header, topics

NO_COUNTS = "the log has no message counts: an older simscen wrote it, or its end was edited"

_EVENTS = frozenset(
    {Evidence.CONTACTS, Evidence.NAVIGATION, Evidence.ERROR_CODES, Evidence.PLANNING, Evidence.RECOVERIES}
) | {Evidence.DISTURBANCES, Evidence.OBJECTS}
_EVIDENCE: dict[str, frozenset[Evidence]] = {
    topics.TRUTH.name: frozenset({Evidence.TRUTH, Evidence.VELOCITY}),
    topics.CLEARANCE.name: frozenset({Evidence.CLEARANCE}),
    topics.BELIEF.name: frozenset({Evidence.BELIEF, Evidence.COVARIANCE}),
    topics.COMMAND.name: frozenset({Evidence.COMMANDS}),
    topics.PLAN.name: frozenset({Evidence.PLANS}),
    topics.EVENTS.name: _EVENTS,
    topics.TF.name: frozenset({Evidence.OBJECTS}),
}


class MessageCounts:
    """Counts the messages of each topic, checks the order of their times, and compares the counts with the log's."""

    def __init__(self) -> None:
        self._topics: dict[int, str] = {}
        self._scans: set[str] = set()
        self._found: dict[int, int] = {}
        self._newest: dict[int, int] = {}
        self._expected: dict[str, int] | None = None

    def add_channel(self, channel: int, topic: str, message_type: str) -> None:
        """Add a channel of the log, by its number; it holds the messages of one topic."""
        self._topics[channel] = topic
        if message_type == topics.SCAN_TYPE:
            self._scans.add(topic)

    def add_message(self, channel: int, time: int) -> None:
        """Count a message. Raises ValueError if an earlier message of its topic has a later time."""
        if time < self._newest.get(channel, time):
            raise ValueError(f"the messages of {self._topics.get(channel, 'a topic')} are not in the order of time")
        self._newest[channel] = time
        self._found[channel] = self._found.get(channel, 0) + 1

    def set_expected(self, end: Mapping[str, str], robot: str = "") -> None:
        """Read the counts from the end record. With `robot`, use only the topics in its namespace."""
        prefix = log_header.COUNT_PREFIX + (f"/{robot}" if robot else "")
        counts = {name: int(count) for name, count in end.items() if name.startswith(log_header.COUNT_PREFIX)}
        if counts:
            self._expected = {
                name.removeprefix(prefix): count for name, count in counts.items() if name.startswith(f"{prefix}/")
            }

    def coverage(self) -> LogCoverage:
        """Return which evidence the log lacks because it holds fewer messages than were recorded.

        Evidence is missing if all messages of its topic are lost, and partial if some of them are. The reason states
        both counts. Without recorded counts, all evidence is partial.
        """
        if self._expected is None:
            return LogCoverage(partial=dict.fromkeys(Evidence, NO_COUNTS))
        found = {topic: self._found.get(channel, 0) for channel, topic in self._topics.items()}
        missing: dict[Evidence, str] = {}
        partial: dict[Evidence, str] = {}
        for topic, count in self._expected.items():
            number = found.get(topic, 0)
            if number == count:
                continue
            is_scan = topic in self._scans or topic.endswith("scan")  # the type of a removed topic is unknown
            evidence = _EVIDENCE.get(topic, frozenset({Evidence.SCANS} if is_scan else ()))
            reasons = dict.fromkeys(evidence, f"{topic} holds {number} of {count} recorded messages")
            (partial if number else missing).update(reasons)
        return LogCoverage(missing, partial)
