"""Reader of logs that simscen recorded."""
