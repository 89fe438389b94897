"""Expansion of xacro files. Unlike xacro itself, it does not execute Python code from the files."""
