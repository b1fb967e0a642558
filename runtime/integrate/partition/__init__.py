"""Independent coordinates by partitioning, for explicit Runge-Kutta methods."""
