"""Stops and dry friction during a run: impacts, rest, sticking and slipping."""
