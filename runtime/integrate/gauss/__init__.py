"""Gauss collocation."""
