"""Robots from the files of other programs: URDF to models."""
