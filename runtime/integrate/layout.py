"""Indices of the flat arrays that jitted integrators share with Python, and their status codes."""

# Kernel addresses (uint64); 0 where the model has no such function.
RHS, PROJECT, EVENTS, RESIDUAL, RESIDUAL_JACOBIAN, ENERGY = range(6)
CONSTRAINT_RESIDUAL, CONSTRAINT_JACOBIAN, GAMMA, MASS_MATRIX, FORCES = range(6, 11)
STABILISE = 11  # `project`, in runs with Baumgarte's stabilisation
N_KERNELS = 12

# Sizes (int64): N_SIZES numbers, then the direction (+1 rising, -1 falling, 0 both) of every event, then where
# in q each quaternion begins, and NQ at the end (see `quaternions.py`).
NQ, NV, NW, NH, NM, NE, NY, N_ROW = range(8)  # NY = NQ+NV+NW; N_ROW = length of an rhs row (NY + m + (m > 0))
N_SIZES = 8

# Control (float64): settings first, then what the step loop carries from call to call, then the events' state.
RTOL, ATOL, H_MAX, H_MIN, T_STOP, T, H, ERROR_OLD, PROJECTION_TOL, NEWTON_TOL = range(10)
# T_STOP: a step ends exactly there, and the loop returns (REACHED_STOP). H: the next step to try (<= 0: choose one),
# or the step itself of a fixed-step method. Time only runs forward. NEWTON_TOL: what implicit methods leave of Newton's
# error, in units of the error tolerance; 0: the method's own choice.
MAX_RESIDUAL, MIN_PIVOT_RATIO, T_EVENT, H_LAST, T_GRID = range(10, 15)
# T_GRID: fixed-step methods step to T_GRID + k H, k = counters[GRID_STEP] + 1, so that time does not drift.
ENERGY_LEVEL, ENERGY_STEP, ENERGY_TAKEN, MOST_ENERGY_TAKEN = range(15, 19)
# Energy scaling: the energy kept, what the last step took of it, the sum of that, the largest magnitude of the sum.
T_WATCH, T_START, H_BASE, H_SHARE, ASIDE, H_EVENT, EVENTLESS = range(19, 26)
# T_WATCH: before a step that may pass this time the loop returns (NEAR_WATCH), having changed nothing of the motion.
# A step is at most H_BASE + H_SHARE (T - T_START) long. ASIDE: 1 where steps are taken beside the run, for a state that
# somebody wants to see: no events are looked for. H_EVENT: how long the step after an event may be; 0: as any.
# EVENTLESS: the time between the last two events, or since then the longest step without any.
N_CONTROL = 26
# control[N_CONTROL + SIDE * NE + e]: side of zero of event function e before the step, 0 while it has not left
# zero yet, ±LEANING while it is at zero but belongs to a side (see `events.py`);
# ... FIRED: 1 where event e fired in the step that returned EVENT (several may, at one instant);
# ... FLOOR: |g| of event e at or below this is round-off;
# ... BAND: |g| beyond which a function that is at zero has left it;
# ... LOWEST: the least g at the ends of steps;
# ... PASSED, T_PASSED: how many steps crossed zero and came back unseen, as a look at a random place shows, and where.
# ... BRANCH: where in p the branch of a force is that event e switches, 0 if it switches none.
SIDE, FIRED, FLOOR, BAND, LOWEST, PASSED, T_PASSED, BRANCH = range(8)
LEANING = 0.5
N_EVENT_BLOCKS = 8

# Counters (int64).
STEPS, REJECTED, RHS_CALLS, JACOBIANS, FACTORISATIONS, NEWTON_ITERATIONS, PROJECTIONS = range(7)
NEXT_FRAME, N_LOGGED_STEPS, MAX_STEPS_PER_CALL, F_VALID, EVENT_INDEX, LAST_REJECTED, STIFF_COUNT = range(
    7, 14
)
NON_STIFF_COUNT, GRID_STEP = range(14, 16)
# STIFF_COUNT: signs of stiffness in a row (15: stiff). Counters from FAMILY_COUNTERS on belong to the family that runs.
FAMILY_COUNTERS = 16
N_COUNTERS = 24

# Status of a call of an `advance_*` loop.
RUNNING = 0  # MAX_STEPS_PER_CALL steps done or the step log is full; call again
REACHED_STOP = 1  # control[T] == control[T_STOP]
NEAR_WATCH = 3  # the next step may pass control[T_WATCH]; it is taken with T_WATCH = inf
EVENT = 2  # state is at control[T_EVENT] == control[T], just past the event counters[EVENT_INDEX]
STEP_TOO_SMALL = -1
NOT_FINITE = -2  # the state or its derivative became inf or nan
NEWTON_FAILED = -3
PROJECTION_FAILED = -4
SINGULAR_MATRIX = -5
PARTITION_LOST = -6  # no coordinates are independent: constraints lose rank
