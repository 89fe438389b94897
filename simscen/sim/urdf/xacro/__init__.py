"""Expansion of xacro files. Unlike xacro itself, simscen does not execute Python code from the files."""
