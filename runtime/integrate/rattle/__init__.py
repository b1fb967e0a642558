"""RATTLE and its symmetric compositions."""
