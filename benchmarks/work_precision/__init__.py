"""Work-precision benchmarks: run time against error for every method on scenes with known end states."""
