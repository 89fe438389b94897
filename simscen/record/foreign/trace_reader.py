"""What became of goals, as a navigation action's status topic tells it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Ticks
from simscen.core.records.verdict import Evidence
from simscen.record.foreign.decoded import (
    DecodedMessages,
    Track,
    is_twist_missing,
    stamped_messages,
    track_from_tf,
    track_from_topic,
    velocity_from_poses,
)
from simscen.record.foreign.messages import POSES, GoalState
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.raw_messages import UnusableLog
from simscen.record.foreign.timebase import StampedMessages, Timebase
from simscen.record.trace_builder import TraceRows, to_planar

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""action_msgs/msg/GoalStatus."""
_ENDS = {
    SUCCEEDED: (EventKind.GOAL_REACHED, "SUCCEEDED"),
    CANCELED: (EventKind.GOAL_CANCELED, "CANCELED"),
    ABORTED: (EventKind.GOAL_FAILED, "FAILED"),
}


def goal_events(told: Sequence[tuple[int, list[GoalState]]], names: Sequence[str]) -> list[Event] | str:
    """The goals' events from (tick, states), where the k-th goal of the log is the k-th of `names`; or why not.

    A goal that had ended before the log began is not of this log.
    """
    accepted: dict[bytes, int] = {}
    ended: dict[bytes, tuple[int, int]] = {}
    earlier: set[bytes] = set()
    for number, (tick, states) in enumerate(told):
        for state in states:
            if number == 0 and state.status in _ENDS:
                earlier.add(state.id)
            if state.id in earlier:
                continue
            accepted.setdefault(state.id, tick)
            if state.status in _ENDS:
                ended.setdefault(state.id, (tick, state.status))
    if len(accepted) != len(names):
        return f"the log has {_count(len(accepted))}, the scenario {_count(len(names))}"
    events = [
        event
        for name, (identity, tick) in zip(names, accepted.items(), strict=True)
        for event in _events_of_goal(name, tick, ended.get(identity))
    ]
    last = [ended.get(identity) for identity in accepted][-1:]
    if len(ended) == len(accepted) and last and last[0] is not None:
        events.append(Event(last[0][0], EventKind.NAVIGATION_ENDED, _ENDS[last[0][1]][1]))
    return sorted(events, key=lambda event: event.tick)


def _events_of_goal(name: str, accepted: int, ended: tuple[int, int] | None) -> list[Event]:
    events = [Event(accepted, EventKind.GOAL_ACCEPTED, name)]
    return [*events, *([] if ended is None else [Event(ended[0], _ENDS[ended[1]][0], name)])]


def _count(number: int) -> str:
    return f"{number} goal" if number == 1 else f"{number} goals"


MAX_TRUTH_GAP_S = 1.0
"""Seconds without a word about the truth from which on something may have happened in between."""
MAX_DISTANCE_BEFORE_BELIEF_M = 0.3
"""Meters that a robot may drive before AMCL first says where it is: Nav2's update_min_d of 0.25 m, and a bit."""
MAX_LISTED_TOPICS = 12
_NOT_ON_STANDARD_TOPICS = (
    *(Evidence.CLEARANCE, Evidence.CONTACTS, Evidence.ERROR_CODES, Evidence.PLANNING, Evidence.RECOVERIES),
    Evidence.OBJECTS,
)
_ALWAYS_MISSING = {
    **dict.fromkeys(_NOT_ON_STANDARD_TOPICS, "no standard topic tells"),
    Evidence.DISTURBANCES: "only a log of simscen's own tells when faults and events were",
    Evidence.FOOTPRINT: "the scenario names no `robot:`",
}

_EVIDENCE_OF_ROLE = {"cmd_vel": Evidence.COMMANDS, "scan": Evidence.SCANS, "plan": Evidence.PLANS}


class ForeignTraceReader:
    """One log: its `rows` and `time`, what is `missing` or there in part, and `notes` on what is odd."""

    def __init__(self, found: DecodedMessages, topics: dict[str, str], wanted: ForeignLogOptions) -> None:
        self._found, self._topics, self._wanted = found, topics, wanted
        self.notes: list[str] = []
        self.missing: dict[Evidence, str] = dict(_ALWAYS_MISSING)
        self.partial: dict[Evidence, str] = {}
        self.rows = TraceRows()
        truth, belief = self._truth(), self._track("amcl_pose", Evidence.BELIEF, Evidence.COVARIANCE)
        self.time = self._timebase(truth, belief)
        if truth is not None:
            self._add_truth(truth)
        if belief is not None:
            self._add_belief(belief)
        self._align(truth, belief)
        if belief is not None and not belief.covariances.any():
            self.missing[Evidence.COVARIANCE] = f"{belief.source} tells no covariance"
        self._add_others()
        self._add_goals()

    def _truth(self) -> Track | None:
        frames = self._wanted.frames
        if frames is None:
            return self._track("truth", Evidence.TRUTH, Evidence.VELOCITY)
        track = track_from_tf(*frames, self._found, self._wanted)
        if isinstance(track, str):
            self.missing |= dict.fromkeys((Evidence.TRUTH, Evidence.VELOCITY), track)
            return None
        return track

    def _track(self, role: str, *evidence: Evidence) -> Track | None:
        """The track of a role; without one, why its evidence is missing."""
        topic = (self._wanted.truth or "") if role == "truth" else self._wanted.topic(role)
        said = self._found.said[role]
        if said:
            return track_from_topic(topic, said, self._wanted)
        self.missing |= dict.fromkeys(evidence, self._why_not(role, topic))
        return None

    def _why_not(self, role: str, topic: str) -> str:
        if role in self._found.lacking:
            return self._found.lacking[role]
        if topic in self._topics:
            return f"{topic} has no messages"
        poses = [name for name, kind in sorted(self._topics.items()) if kind in POSES and name != topic]
        could = f"; poses are on: {', '.join(poses[:MAX_LISTED_TOPICS])}" if poses else ""
        if not topic:
            return f"nothing counts as the truth: name a topic or two frames with --truth{could}"
        return f"the log has no topic {topic}{could}"

    def _timebase(self, *tracks: Track | None) -> Timebase:
        """Over all messages that were wanted, by the stamps of the best topic that has any."""
        logged = [
            np.array([time for time, _ in said], dtype=np.int64)
            for role, said in self._found.said.items()
            if said and role != "tf_static"
        ]
        if not logged:
            names = ", ".join(sorted(self._topics)[:MAX_LISTED_TOPICS]) or "none at all"
            why = "".join(f"; {reason}" for reason in self._found.lacking.values())
            raise UnusableLog(
                f"it holds nothing that could be judged{why}", f"its topics: {names}; name others with --topic"
            )
        own = [track.stamped for track in tracks if track is not None and track.stamped is not None]
        others = (self._stamped(role) for role in ("odom", "scan"))
        anchor = next((one for one in (*own, *others) if one is not None), None)
        if anchor is None and self._wanted.clock == "header":
            self.notes.append("no message that matters has a stamp: times are those of logging")
        return Timebase.over(logged, self._wanted.tick_rate, anchor)

    def _stamped(self, role: str) -> StampedMessages | None:
        said = self._found.said[role]
        logged, stamps = [time for time, _ in said], [_stamp(one) or 0 for _, one in said]
        return stamped_messages(self._wanted.topic(role), logged, stamps, self._wanted)

    def _ticks(self, track: Track) -> Ticks:
        if track.stamped is None:
            if self.time.anchor is not None:
                self.notes.append(f"{track.source}: its stamps are all zero; its times are those of logging")
            return self.time.of_logged(track.logged)
        if track.stamped.disorder:
            self.notes.append(f"{track.source}: {track.stamped.disorder}")
        return self.time.of_stamped(track.stamped)

    def _add_truth(self, track: Track) -> None:
        ticks, kept = _last_per_tick(self._ticks(track))
        poses, ground = track.poses[kept], to_planar(track.poses[kept])
        twists = None if track.twists is None else track.twists[kept]
        if twists is not None and is_twist_missing(twists, ground):
            told = "its twist is zero though the robot moves; its poses say how fast"
            self.notes.append(f"{track.source}: {told}")
            twists = None
        if twists is None:
            twists = velocity_from_poses(ticks, ground, self.time.rate)
        self.rows.truth.extend(ticks, np.column_stack((poses, twists)))
        if gap := self._gap(ticks):
            self.partial |= dict.fromkeys((Evidence.TRUTH, Evidence.VELOCITY), f"{track.source} says nothing {gap}")

    def _gap(self, ticks: Ticks) -> str:
        """The first stretch without a sample that is too long; "" when there is none."""
        edges = np.concatenate(([0], ticks, [self.time.end]))
        long = np.flatnonzero(np.diff(edges) > MAX_TRUTH_GAP_S * self.time.rate)
        if not len(long):
            return ""
        begin, end = edges[long[0]] / self.time.rate, edges[long[0] + 1] / self.time.rate
        return f"from t = {begin:.2f} s to {end:.2f} s"

    def _add_belief(self, track: Track) -> None:
        ticks, kept = _last_per_tick(self._ticks(track))
        self.rows.belief.extend(ticks, np.column_stack((track.poses[kept], track.covariances[kept])))
        truth_ticks, truth = self.rows.truth.columns()
        before = truth[truth_ticks <= ticks[0], :2]
        moved = float(np.hypot(*np.ptp(before, axis=0))) if len(before) else 0.0
        if moved > MAX_DISTANCE_BEFORE_BELIEF_M:
            at = ticks[0] / self.time.rate
            self.partial[Evidence.BELIEF] = f"{track.source} begins at t = {at:.2f} s, after {moved:.2f} m of driving"

    def _align(self, truth: Track | None, belief: Track | None) -> None:
        """Whether positions of the truth can be compared with those on the map."""
        map_frame = "map" if belief is None else belief.frame
        if truth is None or self._wanted.same_frame or truth.frame == map_frame:
            return
        told = f"{truth.source} is told in frame `{truth.frame}`, the map's is `{map_frame}`"
        self.missing[Evidence.ALIGNMENT] = f"{told}; if they are the same, say --same-frame"

    def _add_others(self) -> None:
        """What criteria look at beside: odometry, commands, scans and plans."""
        for role in ("odom", "cmd_vel", "scan", "plan"):
            said = self._found.said[role]
            if not said:
                missing = [_EVIDENCE_OF_ROLE[role]] if role in _EVIDENCE_OF_ROLE else []
                self.missing |= dict.fromkeys(missing, self._why_not(role, self._wanted.topic(role)).split(";")[0])
                continue
            by_stamp = self._stamped(role) if all(_stamp(one) is not None for _, one in said) else None
            logged = np.array(sorted(time for time, _ in said), dtype=np.int64)
            ticks = self.time.of_logged(logged) if by_stamp is None else self.time.of_stamped(by_stamp)
            values = [one for _, one in sorted(said, key=lambda one: one[0])]
            self._add_role(role, ticks, values)

    def _add_role(self, role: str, ticks: Ticks, values: list[Any]) -> None:
        kept_ticks, kept = _last_per_tick(ticks)
        match role:
            case "odom":
                self.rows.odometry.extend(kept_ticks, np.array([values[k].pose for k in kept]))
            case "cmd_vel":
                self.rows.command.extend(kept_ticks, np.array([values[k].values for k in kept]))
            case "scan":
                self.rows.scans.extend(ticks.tolist())
            case "plan":
                self.rows.plans.extend((int(tick), plan.poses) for tick, plan in zip(ticks, values, strict=True))

    def _add_goals(self) -> None:
        said = sorted(self._found.said["status"], key=lambda one: one[0])
        if not said:
            self.missing[Evidence.NAVIGATION] = self._why_not("status", self._wanted.topic("status")).split(";")[0]
            return
        ticks = self.time.of_logged(np.array([time for time, _ in said], dtype=np.int64))
        events = goal_events([(int(t), states) for t, (_, states) in zip(ticks, said, strict=True)], self._wanted.goals)
        if isinstance(events, str):
            self.missing[Evidence.NAVIGATION] = events
        else:
            self.rows.events.extend(events)


def _stamp(said: Any) -> int | None:
    """The header's time of what a message says; None where it has no header."""
    return said if isinstance(said, int) else said.stamp


def _last_per_tick(ticks: Ticks) -> tuple[Ticks, Ticks]:
    """Ascending ticks, each once, and which message counts for each: the one that came last."""
    order = np.argsort(ticks, kind="stable")
    ascending = ticks[order]
    last = np.append(ascending[1:] != ascending[:-1], True)
    return ascending[last], order[last]
