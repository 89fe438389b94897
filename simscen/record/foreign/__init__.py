"""Logs of real robots: MCAP files and rosbag2 folders with the standard topics, read into a Trace as far as they go."""
