"""Ensembles: one model many times, several members at once in the lanes of vector registers."""
