"""Readers of odometry, scans, and reference poses from recorded logs, for `simscen localize`."""
