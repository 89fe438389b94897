"""Conditions that start events, each with its specification and implementation."""
