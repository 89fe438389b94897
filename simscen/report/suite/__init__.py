"""The HTML report of a session, report.html, with the history of earlier sessions."""

from simscen.report.suite.page import RunningSession, Session, to_html

__all__ = ["RunningSession", "Session", "to_html"]
