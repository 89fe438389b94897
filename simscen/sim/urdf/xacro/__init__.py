"""xacro without Python: xacro runs what a file says, so its macros and arithmetic are expanded by ourselves."""
