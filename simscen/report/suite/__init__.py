"""report.html: a session in a browser, with what sessions before it said."""

from simscen.report.suite.page import RunningSession, Session, to_html

__all__ = ["RunningSession", "Session", "to_html"]
