"""Radau IIA methods."""
