"""The world during a run: observed by triggers, and changed by events and actions."""
