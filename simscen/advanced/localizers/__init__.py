"""Scan-matching AMCL with relocalization search, and an EKF that detects wheel slip."""
