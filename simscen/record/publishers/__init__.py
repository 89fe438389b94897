"""Publishers of the messages on the topics of a log."""
