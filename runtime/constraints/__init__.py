"""Constrained models: consistent starts, redundancy, rank."""
