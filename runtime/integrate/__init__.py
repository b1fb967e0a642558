"""Methods of integration and the step loops that run them, compiled once for all models."""
