"""Trees of joints: links and their frames, recursive algorithms of O(n), their derivatives, M⁻¹ f in O(n)."""
