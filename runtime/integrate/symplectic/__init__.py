"""Semi-implicit Euler, Verlet, and symmetric compositions of Verlet."""
