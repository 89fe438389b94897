"""replay.html: a run to look at, from its log alone; what the robot saw, believed and did, and what was asked."""

from simscen.report.replay.page import replay_page, write_replay

__all__ = ["replay_page", "write_replay"]
