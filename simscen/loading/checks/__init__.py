"""Semantic checks of valid files: names exist, events can happen, criteria can fail, and goals can be reached."""
