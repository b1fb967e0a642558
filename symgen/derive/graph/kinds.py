"""Kinds of variable on the operation graph, each with its own bit in a node's dependency mask."""

# LOCAL: stand-ins within a derivative; VIRTUAL: virtual velocities, by which a virtual power is differentiated.
T, Q, V, A, LAM, PARAM, INPUT, LOCAL, VIRTUAL = (1 << k for k in range(9))
MOTION = T | Q | V | A | LAM | INPUT  # everything that can change during a run
