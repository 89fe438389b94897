"""The world during a run: what triggers observe, and what events and actions change."""
