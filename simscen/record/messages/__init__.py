"""Encoding and decoding of the ROS 2 messages of a log."""
