"""A run as an MCAP log that ROS 2 tools open, and back to the very same Trace."""
