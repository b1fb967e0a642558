"""Scenes of many subsystems: which act on each other, which are equal, and what looks at all of them."""
