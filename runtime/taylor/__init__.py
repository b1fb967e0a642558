"""Taylor series of a model's motion: from the text of its functions to machine code that gives the coefficients."""
