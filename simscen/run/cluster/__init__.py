"""Run sessions on a Ray cluster."""
