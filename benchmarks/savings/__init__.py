"""What each saving gains: the cases of `benchmarks/skip.py`."""
