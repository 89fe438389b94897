"""Localizers: AMCL, extended Kalman filter (EKF), dead reckoning, and ground truth."""
