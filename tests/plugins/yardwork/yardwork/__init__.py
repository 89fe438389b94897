"""Types for simscen as another maker would ship them."""
