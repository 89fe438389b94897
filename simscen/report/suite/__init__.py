"""The HTML report of a session, report.html."""

from simscen.report.suite.page import RunningSession, SessionReport, to_html

__all__ = ["RunningSession", "SessionReport", "to_html"]
