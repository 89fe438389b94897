"""Where the robot is: AMCL, an EKF, dead reckoning, and the truth. Names, parameters and defaults are Nav2's."""
