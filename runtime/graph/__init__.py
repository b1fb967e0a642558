"""Scalar operations and what is known about them; knows neither SymPy nor text, so both halves may import it."""
