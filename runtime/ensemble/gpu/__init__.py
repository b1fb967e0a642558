"""Ensembles on graphics processors: the loops and functions of the lanes, one thread for each member."""
