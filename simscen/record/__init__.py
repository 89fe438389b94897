"""Recording of runs to MCAP logs that ROS 2 tools can open, and reading of logs."""
