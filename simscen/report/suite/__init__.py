"""report.html: a session in a browser, with what sessions before it said."""

from simscen.report.suite.page import Live, Session, to_html

__all__ = ["Live", "Session", "to_html"]
