"""Linear solves as operations: sparse LDLᵀ written out, dense LDLᵀ by loops."""
