"""Publishers that turn the state of a run into messages on the topics of its log."""
