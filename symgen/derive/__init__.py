"""From a description of a model to its equations of motion as operations."""
