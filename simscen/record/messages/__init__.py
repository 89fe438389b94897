"""ROS 2 messages of a log: encoding and decoding of CDR, text of events."""
