"""Signal temporal logic: conditions over signals and time, their robustness and their wording."""
