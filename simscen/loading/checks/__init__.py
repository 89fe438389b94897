"""Check what valid files mean: whether names exist, events can happen, criteria can fail, and goals can be reached."""
