"""Check that no messages were removed from a log, by the message counts in its end record."""

from collections.abc import Mapping

from simscen.core.records.verdict import Evidence, LogCoverage
from simscen.record import log_header, topics

NO_COUNTS = "the log has no message counts: an older simscen wrote it, or its end was edited"
"""Reason why all evidence of a log may be incomplete."""

_EVENT_EVIDENCE = frozenset(
    {
        Evidence.CONTACTS,
        Evidence.NAVIGATION,
        Evidence.ERROR_CODES,
        Evidence.PLANNING,
        Evidence.RECOVERIES,
        Evidence.DISTURBANCES,
        Evidence.OBJECTS,
    }
)
"""Evidence (kinds of recorded information) that events contain."""
_EVIDENCE_BY_TOPIC: dict[str, frozenset[Evidence]] = {
    topics.TRUTH.name: frozenset({Evidence.TRUTH, Evidence.VELOCITY}),
    topics.CLEARANCE.name: frozenset({Evidence.CLEARANCE}),
    topics.BELIEF.name: frozenset({Evidence.BELIEF, Evidence.COVARIANCE}),
    topics.COMMAND.name: frozenset({Evidence.COMMANDS}),
    topics.PLAN.name: frozenset({Evidence.PLANS}),
    topics.EVENTS.name: _EVENT_EVIDENCE,
    topics.TF.name: frozenset({Evidence.OBJECTS}),
}
"""Evidence that the messages of each topic contain. Topics of scans are missing here because their names vary."""


class MessageCounts:
    """Counts the messages of each topic, and compares the counts with the end record of the log."""

    def __init__(self) -> None:
        self._topics_by_channel: dict[int, str] = {}
        self._scan_topics: set[str] = set()
        self._counts: dict[str, int] = {}
        self._last_times: dict[str, int] = {}
        self._expected_counts: dict[str, int] | None = None

    def add_channel(self, channel: int, topic: str, message_type: str) -> None:
        """Add the channel with the ID `channel`. Several channels may have the same topic."""
        self._topics_by_channel[channel] = topic
        if message_type == topics.SCAN_TYPE:
            self._scan_topics.add(topic)

    def add_message(self, channel: int, time: int) -> None:
        """Count a message at `time` ns. Raises ValueError if the previous message of the topic has a later time."""
        topic = self._topics_by_channel.get(channel, "")
        if time < self._last_times.get(topic, time):
            raise ValueError(f"the messages of {topic or 'a topic'} are not in the order of time")
        self._last_times[topic] = time
        self._counts[topic] = self._counts.get(topic, 0) + 1

    def set_expected(self, end_record: Mapping[str, str], robot: str = "") -> None:
        """Set the expected counts of the topics in the namespace of `robot`; "" for topics without a namespace."""
        prefix = log_header.COUNT_PREFIX + (f"/{robot}" if robot else "")
        counts = {key: int(count) for key, count in end_record.items() if key.startswith(log_header.COUNT_PREFIX)}
        if counts:
            self._expected_counts = {
                key.removeprefix(prefix): count for key, count in counts.items() if key.startswith(f"{prefix}/")
            }

    def coverage(self) -> LogCoverage:
        """Return the evidence that the log lacks because messages were removed after the recording.

        Evidence is missing if all messages of the topic were removed, and partial if some messages were removed. All
        evidence is partial if the log has no message counts.
        """
        if self._expected_counts is None:
            return LogCoverage(partial=dict.fromkeys(Evidence, NO_COUNTS))
        missing: dict[Evidence, str] = {}
        partial: dict[Evidence, str] = {}
        for topic, expected_count in self._expected_counts.items():
            count = self._counts.get(topic, 0)
            if count == expected_count:
                continue
            is_scan = topic in self._scan_topics or topic.endswith("scan")  # the type of a removed topic is unknown
            evidence = _EVIDENCE_BY_TOPIC.get(topic, frozenset({Evidence.SCANS} if is_scan else ()))
            reasons = dict.fromkeys(evidence, f"{topic} holds {count} of {expected_count} recorded messages")
            (partial if count else missing).update(reasons)
        return LogCoverage(missing, partial)
