"""The operation graph: operations, their derivatives and rewritings; vectors, rotations and inertias on it."""
