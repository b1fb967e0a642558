"""Equal parts of a long function, found on the graph so that loops can repeat them."""
