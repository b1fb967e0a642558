"""Equations and solutions written by hand, which share no code with the product."""
