"""Rerun's file format: all that imports rerun. Columns in and out; nothing of mechanics."""
