"""Backward differences of variable order."""
