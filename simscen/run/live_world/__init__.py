"""The running world: what triggers observe and what events and actions change."""
