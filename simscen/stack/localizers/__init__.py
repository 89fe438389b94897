"""Localizers: AMCL, an EKF, dead reckoning, and ground truth."""
