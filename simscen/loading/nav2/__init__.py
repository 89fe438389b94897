"""Translate Nav2 parameter files to parameters of the reference stack."""
