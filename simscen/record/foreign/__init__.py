"""Reader of logs of real robots: MCAP files and rosbag2 folders with standard topics."""
