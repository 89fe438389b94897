"""Expansion of xacro files without executing code, which xacro itself would do."""
