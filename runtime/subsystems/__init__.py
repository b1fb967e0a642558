"""Independent subsystems integrated by themselves: each with its own step and method, and asleep while at rest."""
