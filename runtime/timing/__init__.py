"""What a run's steps have to land on and to be held to: breaks, pulses and oscillations in time."""
