"""Reading and writing files: strict, of limited size, one clear error."""
