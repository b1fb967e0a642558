"""Implicit methods of one stage: Euler's and the midpoint rule."""
