"""Indices of the flat arrays of prepared runs, and what becomes of a run, as numbers and as words."""

# Addresses (uint64): the step loop's block, the hoisted work of `p`, and kernels that take a precomputed `p`.
ADVANCE, SETUP, STRAIGHT_RHS, RESIDUAL, JACOBIAN, GAMMA, MASS, ENERGY = range(8)
N_ADDRESSES = 8

# What is asked (float64).
T_END, SAME_WITHIN, ADAPTIVE, HAS_FALLBACK, MAX_STEPS, SCALES_ENERGY, HAS_HOISTED = range(7)
CHECKS, ENERGY_LIMIT, DRIFT_LIMIT = range(7, 10)
N_ASKED = 10
# SAME_WITHIN: times that are nearer to each other are one [s]. SCALES_ENERGY: 0 no, 1 where it suits, 2 it is wanted.

# Where a call of `run_rows` is (int64): the row under way, whether it has begun, the row to stop before, steps taken.
ROW, UNDER_WAY, LAST, STEPS_TO_GO = range(4)
N_PLACES = 4

# What became of a run. Below zero: it failed; the first ones are the statuses of step loops (`integrate/layout.py`).
SUCCESS, TERMINATED, ZENO, DOUBTFUL = range(4)
NOT_FINITE_INPUT = -10  # a parameter or a start is not a number
REFUSED_START = -11  # it contradicts the constraints, or inertia is negative
STEPS_USED_UP = -12
INTERRUPTED = -13
FAILED = -14  # elsewhere: at an event, for lack of progress
# Between machine code and Python only.
NEEDS_ASSEMBLY = 100  # the start does not meet the constraints to the last digit
NEEDS_PYTHON = 101  # machine code alone cannot handle the run
GOES_ON = 102  # the call has had its share of steps

WORDS = {
    SUCCESS: "success",
    TERMINATED: "terminated",
    ZENO: "zeno",
    DOUBTFUL: "doubtful",
    INTERRUPTED: "interrupted",
}
"""Words for statuses; all others are "failed"."""
