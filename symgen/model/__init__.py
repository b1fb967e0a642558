"""What the user said: the description of a model, and the ways to make one."""
