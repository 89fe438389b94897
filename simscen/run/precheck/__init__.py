"""What is looked at before anything runs: whether a scenario can mean what it says in its world."""
