"""Runs that are prepared once and made many times, most of them wholly in machine code."""
