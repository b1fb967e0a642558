"""The generalised-α method and HHT."""
