"""Whether a result can be trusted, and which method and step would suit."""
