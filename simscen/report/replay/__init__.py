"""The replay page, replay.html, which plays a run in a browser: world, sensors, belief, plans, and criteria."""

from simscen.report.replay.page import replay_page, write_replay

__all__ = ["replay_page", "write_replay"]
