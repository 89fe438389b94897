"""What a person or another program reads of a session: console, JUnit, JSON, pictures, a page."""
