"""Localizers: AMCL, an EKF, dead reckoning, and ground truth. Names, parameters, and defaults are those of Nav2."""
