"""Conversion of the decoded messages of a real robot's log to the signals and events of a Trace."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from simscen.core.clock import NS_PER_SECOND
from simscen.core.records.trace import Ticks
from simscen.core.records.verdict import Evidence
from simscen.record import topics
from simscen.record.foreign.decoded_messages import DecodedMessages
from simscen.record.foreign.goal_events import goal_events
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.raw_messages import UnusableLog
from simscen.record.foreign.timebase import MAX_STAMP_DIFFERENCE_NS, StampedMessages, Timebase
from simscen.record.foreign.tracks import (
    Track,
    is_twist_missing,
    stamped_messages,
    track_from_tf,
    track_from_topic,
    velocity_from_poses,
)
from simscen.record.foreign.transforms import UnknownTransform
from simscen.record.messages.decode import POSE_DECODERS
from simscen.record.trace_builder import TraceRows, to_planar

MAX_TRUTH_GAP_S = 1.0
"""Maximum time without ground truth. With a longer gap, the ground truth is partial evidence."""
MAX_UNSEEN_SCAN_AGE_S = 0.25
"""Maximum difference between the longest time without a scan and the largest age of a scan at a sample of the ground
truth.

The signal `scan_age` exists only at these samples. With a larger difference, the scans are partial evidence."""
MIN_LATE_SUBSCRIPTION_S, MAX_LATE_SUBSCRIPTION_S = 0.05, 2.0
"""Times from the first message to the first ground truth or the first scan with which the recorder subscribed late.

The log is then judged from this ground truth or scan on."""
MAX_DISTANCE_BEFORE_BELIEF_M = 0.3
"""Maximum diagonal of the area in which the robot drives before the first pose of AMCL.

If the robot drives farther, the poses of AMCL are partial evidence."""
MAX_LISTED_TOPICS = 12
"""Maximum number of topics in a message to the user."""
_NOT_ON_STANDARD_TOPICS = (
    Evidence.CLEARANCE,
    Evidence.CONTACTS,
    Evidence.ERROR_CODES,
    Evidence.PLANNING,
    Evidence.RECOVERIES,
    Evidence.OBJECTS,
)
_ALWAYS_MISSING: dict[Evidence, str] = {
    **dict.fromkeys(_NOT_ON_STANDARD_TOPICS, "no standard topic contains this"),
    Evidence.DISTURBANCES: "only logs of simscen contain faults and events",
    Evidence.FOOTPRINT: "the scenario has no `robot:`",
}
"""Evidence that logs of real robots never contain, with the reason."""

_EVIDENCE_OF_ROLE = {"cmd_vel": Evidence.COMMANDS, "scan": Evidence.SCANS, "plan": Evidence.PLANS}
"""Evidence that a topic contains, by the role (purpose) of the topic."""


class ForeignTraceReader:
    """Converts the `decoded` messages of one log to signals and events.

    `topics` has the message types of all topics of the log.

    Attributes:
        rows: Signals and events.
        timebase: Conversion of times to ticks.
        missing: Evidence (kinds of information) that the log lacks, with the reason.
        partial: Evidence that the log has for a part of the time, with the reason.
        notes: Remarks for the user.
    """

    def __init__(self, decoded: DecodedMessages, topics: dict[str, str], options: ForeignLogOptions) -> None:
        self._decoded, self._topics, self._options = decoded, topics, options
        self.notes: list[str] = []
        self.missing: dict[Evidence, str] = dict(_ALWAYS_MISSING)
        self.partial: dict[Evidence, str] = {}
        self.rows = TraceRows()
        if options.clock == "header":
            self._remove_unstamped()
        truth, belief = self._truth_track(), self._track("amcl_pose", Evidence.BELIEF, Evidence.COVARIANCE)
        self.timebase = self._create_timebase(truth, belief)
        if truth is not None:
            self._add_truth(truth)
        if belief is not None:
            self._add_belief(belief)
        self._check_frames(truth, belief)
        if belief is not None and not belief.covariances.any():
            self.missing[Evidence.COVARIANCE] = f"{belief.source} has no covariance"
        self._add_other_roles()
        self._check_scan_ages()
        self._add_goals()

    def _remove_unstamped(self) -> None:
        """Remove poses without a stamp from topics whose other messages have stamps."""
        counts: dict[str, int] = {}
        for role in ("truth", "amcl_pose", "odom"):
            messages = self._decoded.by_role[role]
            stamped = _with_stamps(messages)
            if stamped and len(stamped) < len(messages):
                counts[self._topic(role)] = len(messages) - len(stamped)
                self._decoded.by_role[role] = stamped
        self.notes += [f"{topic}: messages without a stamp are ignored ({count})" for topic, count in counts.items()]

    def _topic(self, role: str) -> str:
        return (self._options.truth or "") if role == "truth" else self._options.topic(role)

    def _truth_track(self) -> Track | None:
        """Return the track of the ground truth. If it is unknown, add its evidence to `missing`."""
        frames = self._options.frames
        if frames is None:
            return self._track("truth", Evidence.TRUTH, Evidence.VELOCITY)
        try:
            return track_from_tf(*frames, self._decoded, self._options)
        except UnknownTransform as error:
            self.missing |= dict.fromkeys((Evidence.TRUTH, Evidence.VELOCITY), str(error))
            return None

    def _track(self, role: str, *evidence: Evidence) -> Track | None:
        """Return the track (poses over time) of a role. If the role has no messages, add `evidence` to `missing`."""
        topic, messages = self._topic(role), self._decoded.by_role[role]
        if messages:
            return track_from_topic(topic, messages, self._options)
        self.missing |= dict.fromkeys(evidence, self._reason_missing(role, topic))
        return None

    def _reason_missing(self, role: str, topic: str) -> str:
        """Return why the log has no messages with a role, and after it a list of other topics that contain poses."""
        if role in self._decoded.problems:
            frames = ": name two frames, such as map:base_link" if topic == topics.TF.name else ""
            return f"{self._decoded.problems[role]}{frames}"
        if topic in self._topics:
            return f"{topic} has no messages"
        pose_topics = [name for name, kind in sorted(self._topics.items()) if kind in POSE_DECODERS and name != topic]
        candidates = f"; topics with poses: {', '.join(pose_topics[:MAX_LISTED_TOPICS])}" if pose_topics else ""
        if not topic:
            return f"no ground truth: name a topic, or two frames such as map:base_link, with --truth{candidates}"
        return f"the log has no topic {topic}{candidates}"

    def _create_timebase(self, truth: Track | None, belief: Track | None) -> Timebase:
        """Return the timebase of all decoded messages except /tf_static.

        The anchor is the first of these that has stamps: ground truth, belief, odometry, scans.
        """
        logged = [
            np.array([time for time, _ in messages], dtype=np.int64)
            for role, messages in self._decoded.by_role.items()
            if messages and role != "tf_static"
        ]
        if not logged:
            names = ", ".join(sorted(self._topics)[:MAX_LISTED_TOPICS]) or "none"
            problems = "".join(f"; {problem}" for problem in self._decoded.problems.values())
            hint = f"its topics: {names}; name others with --topic"
            raise UnusableLog(f"it has no messages that can be judged{problems}", hint)
        stamped = [track.stamped for track in (truth, belief) if track is not None]
        stamped += [self._stamped_messages(role) for role in ("odom", "scan")]
        anchor = next((messages for messages in stamped if messages is not None), None)
        if anchor is None and self._options.clock == "header":
            self.notes.append("no relevant message has a stamp, so the times of logging are used")
        start, end = self._start_of_judging(logged, truth), max(int(times.max()) for times in logged)
        return Timebase.from_logged(start, end, self._options.tick_rate, anchor)

    def _start_of_judging(self, logged: Sequence[Ticks], truth: Track | None) -> int:
        """Return the time of logging in ns from which the log is judged: see MAX_LATE_SUBSCRIPTION_S.

        `logged` are the times of logging of the messages of each role.
        """
        start = int(min(times.min() for times in logged))
        first_times = {} if truth is None else {truth.source: int(truth.logged.min())}
        if scans := self._decoded.by_role["scan"]:
            first_times[self._options.topic("scan")] = min(time for time, _ in scans)
        source, first = max(first_times.items(), key=lambda item: item[1], default=("", start))
        late = (first - start) / NS_PER_SECOND
        if not MIN_LATE_SUBSCRIPTION_S < late <= MAX_LATE_SUBSCRIPTION_S:
            return start
        self.notes.append(f"{source} is recorded {late:.1f} s after the first message; the log is judged from then on")
        return first

    def _stamped_messages(self, role: str) -> StampedMessages | None:
        """Return the stamps of the messages with a role; None if the times of logging are used instead.

        Messages without a stamp are left out.
        """
        stamped = _with_stamps(self._decoded.by_role[role])
        logged, stamps = [time for time, _ in stamped], [_stamp(message) or 0 for _, message in stamped]
        return stamped_messages(self._options.topic(role), logged, stamps, self._options)

    def _ticks(self, track: Track) -> Ticks:
        """Return the ticks of a track, and add notes on problems of its stamps."""
        if track.stamped is None:
            if self.timebase.anchor is not None:
                self.notes.append(f"{track.source}: all stamps are zero, so the times of logging are used")
            return self.timebase.ticks_of_logged(track.logged)
        if track.stamped.order_problems:
            self.notes.append(f"{track.source}: {track.stamped.order_problems}")
        return self.timebase.ticks_of_stamped(track.stamped)

    def _add_truth(self, track: Track) -> None:
        ticks, last = _last_per_tick(self._ticks(track))
        poses, planar = track.poses[last], to_planar(track.poses[last])
        twists = None if track.twists is None else track.twists[last]
        if twists is not None and is_twist_missing(twists, planar):
            text = "all twists are zero although the robot moves, so velocities are computed from the poses"
            self.notes.append(f"{track.source}: {text}")
            twists = None
        if twists is None:
            twists = velocity_from_poses(ticks, planar, self.timebase.rate)
        self.rows.truth.extend(ticks, np.column_stack((poses, twists)))
        if len(ticks) < 2:
            reason = f"{track.source} has messages of only one time"
            self.missing |= dict.fromkeys((Evidence.TRUTH, Evidence.VELOCITY), reason)
        elif gap := self._gap_text(ticks):
            self.partial |= dict.fromkeys((Evidence.TRUTH, Evidence.VELOCITY), f"{track.source} has no message {gap}")

    def _gap_text(self, ticks: Ticks) -> str:
        """Return the times of the first gap between samples above MAX_TRUTH_GAP_S as text; "" without such a gap."""
        edges, rate = np.concatenate(([0], ticks, [self.timebase.last_tick])), self.timebase.rate
        gaps = np.flatnonzero(np.diff(edges) > MAX_TRUTH_GAP_S * rate)
        if not len(gaps):
            return ""
        return f"from t = {edges[gaps[0]] / rate:.2f} s to {edges[gaps[0] + 1] / rate:.2f} s"

    def _add_belief(self, track: Track) -> None:
        ticks, last = _last_per_tick(self._ticks(track))
        self.rows.belief.extend(ticks, np.column_stack((track.poses[last], track.covariances[last])))
        truth_ticks, truth = self.rows.truth.columns()
        earlier_truth = truth[truth_ticks <= ticks[0], :2]
        distance = float(np.hypot(*np.ptp(earlier_truth, axis=0))) if len(earlier_truth) else 0.0
        if distance > MAX_DISTANCE_BEFORE_BELIEF_M:
            start = ticks[0] / self.timebase.rate
            self.partial[Evidence.BELIEF] = (
                f"{track.source} starts at t = {start:.2f} s, after {distance:.2f} m of driving"
            )

    def _check_frames(self, truth: Track | None, belief: Track | None) -> None:
        """Add the alignment of the frames to `missing` if ground truth and belief have different frames."""
        map_frame = "map" if belief is None else belief.frame
        if truth is None or self._options.same_frame or truth.frame == map_frame:
            return
        text = f"{truth.source} is in the frame `{truth.frame}`, the map frame is `{map_frame}`"
        self.missing[Evidence.ALIGNMENT] = f"{text}; if they are the same, use --same-frame"

    def _add_other_roles(self) -> None:
        """Add the odometry, commands, scans, and plans to `rows`, or their evidence to `missing`."""
        for role in ("odom", "cmd_vel", "scan", "plan"):
            messages = sorted(self._decoded.by_role[role], key=lambda message: message[0])
            if not messages:
                if role in _EVIDENCE_OF_ROLE:
                    self.missing[_EVIDENCE_OF_ROLE[role]] = self._short_reason(role)
                continue
            values = [value for _, value in messages]
            ticks = self.timebase.ticks_of_logged(np.array([time for time, _ in messages], dtype=np.int64))
            if (stamped := self._stamped_messages(role)) is not None:
                ticks[_have_stamps(messages)] = self.timebase.ticks_of_stamped(stamped)
            self._add_role(role, ticks, values)

    def _check_scan_ages(self) -> None:
        """Add the scans to `partial` if the longest time without a scan is in a gap of the ground truth."""
        samples, scans = self.rows.truth.columns()[0], np.unique(np.array(self.rows.scans, dtype=np.int64))
        if len(samples) < 2 or not len(scans):
            return
        rate = self.timebase.rate
        begins, ends = np.concatenate(([0], scans)), np.append(scans, self.timebase.last_tick)
        last_samples = samples[np.maximum(np.searchsorted(samples, ends) - 1, 0)]
        longest = int(np.argmax(ends - begins))
        unseen_age = int((ends - begins)[longest] - (last_samples - begins).max()) / rate
        if unseen_age > max(MAX_UNSEEN_SCAN_AGE_S, 2 * float(np.median(np.diff(samples))) / rate):
            begin, end = (int(ticks[longest]) / rate for ticks in (begins, ends))
            reason = f"there is no scan from t = {begin:.2f} s to {end:.2f} s, and no ground truth to show its age"
            self.partial[Evidence.SCANS] = reason

    def _short_reason(self, role: str) -> str:
        """Return why the log has no messages with a role, without the list of other topics."""
        return self._reason_missing(role, self._options.topic(role)).split(";")[0]

    def _add_role(self, role: str, ticks: Ticks, values: list[Any]) -> None:
        """Add the decoded messages `values` of a role to `rows`."""
        distinct_ticks, last = _last_per_tick(ticks)
        match role:
            case "odom":
                self.rows.odometry.extend(distinct_ticks, np.array([values[k].pose for k in last]))
            case "cmd_vel":
                self.rows.command.extend(distinct_ticks, np.array([values[k].values for k in last]))
            case "scan":
                self.rows.scans.extend(ticks.tolist())
            case "plan":
                order = np.argsort(ticks, kind="stable").tolist()
                self.rows.plans.extend((int(ticks[k]), values[k].poses) for k in order)

    def _add_goals(self) -> None:
        """Add the events of goals to `rows`, or their evidence to `missing`."""
        messages = sorted(self._decoded.by_role["status"], key=lambda message: message[0])
        if not messages:
            self.missing[Evidence.NAVIGATION] = self._short_reason("status")
            return
        ticks = self.timebase.ticks_of_logged(np.array([time for time, _ in messages], dtype=np.int64)).tolist()
        states = [states for _, states in messages]
        events = goal_events(list(zip(ticks, states, strict=True)), self._options.goals)
        if isinstance(events, str):
            self.missing[Evidence.NAVIGATION] = events
        else:
            self.rows.events.extend(events)


def _stamp(message: Any) -> int | None:
    """Return the stamp of a decoded message; None for a message without a header."""
    return message if isinstance(message, int) else message.stamp


def _have_stamps(messages: Sequence[tuple[int, Any]]) -> list[bool]:
    """Return for each message whether it has a stamp. `messages` are pairs of a time of logging and a decoded message.

    A stamp of zero usually means that the message has no stamp. It is the start of simulated time if the other stamps
    begin soon after zero.
    """
    stamps = [_stamp(message) or 0 for _, message in messages]
    is_simulated = min(filter(None, stamps), default=0) <= MAX_STAMP_DIFFERENCE_NS
    return [is_simulated or stamp != 0 for stamp in stamps]


def _with_stamps(messages: Sequence[tuple[int, Any]]) -> list[tuple[int, Any]]:
    """Return the messages that have a stamp according to `_have_stamps`."""
    return [message for message, has_stamp in zip(messages, _have_stamps(messages), strict=True) if has_stamp]


def _last_per_tick(ticks: Ticks) -> tuple[Ticks, Ticks]:
    """Return the distinct ticks in ascending order, and the index of the last message at each tick."""
    order = np.argsort(ticks, kind="stable")
    ascending = ticks[order]
    last = np.append(ascending[1:] != ascending[:-1], True)
    return ascending[last], order[last]
