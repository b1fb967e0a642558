"""What machine code of ensembles and Python share: a table of addresses, sizes and numbers; columns of results."""

from __future__ import annotations

_KERNELS = (
    "rhs", "project", "energy", "residual", "setup", "series", "events", "jacobian", "mass_matrix", "forces",
    "constraint_jacobian",
)  # fmt: skip
_SIZES = (
    "n_members", "ny", "n", "nq", "n_row", "n_p", "n_precomputed", "nh", "m", "n_project", "n_quaternions", "n_frames",
    "max_steps", "next", "watch_energy", "scale_energy", "order", "has_tail", "log_size", "n_logged", "n_record",
    "stop", "one_evaluation", "n_events", "n_events_logged", "event_log_size",
    "n_kept", "n_driven", "n_interval", "n_switches", "resumes",
    "own_times", "n_parts", "constant_mass",
)  # fmt: skip
_NUMBERS = (
    "t_start", "t_end", "rtol", "atol", "h_max", "h_base", "h_share", "h_min", "projection_tol", "step", "log_left_out",
    "log_of_turns", "creeps", "stage_rtol", "stage_atol", "newton_bound", "give",
)  # fmt: skip
# Of members, in the order of the queue: plain numbers, a row for each.
_MEMBERS = (
    "start",
    "parameters",
    "precomputed",
    "derivative",
    "results",
    "end",
    "frames",
    "widths",
    "lowest",
)
# Of lanes: vectors.
_LANES = (
    "y", "y_new", "y_stage", "k", "p", "projected", "energies", "residuals", "dense", "numbers", "carry", "slope",
    "k_other", "lost", "watched", "y_before", "newton", "interval",
)  # fmt: skip
_OTHERS = (
    "quaternions", "frame_times", "member_of_lane", "frame_of_lane", "step_log", "event_log", "directions", "places",
    "actions", "resets",
    "intervals", "first_interval", "interval_of_lane", "driven", "first_frame", "parts",
)  # fmt: skip
NAMES = (*_KERNELS, *_SIZES, *_NUMBERS, *_MEMBERS, *_LANES, *_OTHERS)
AT = {name: index for index, name in enumerate(NAMES)}
NUMBERS = frozenset(_NUMBERS)

# What each lane carries, and what is known of each member afterwards: columns of its row in `results`.
COLUMNS = (
    "t", "status", "steps", "rejected", "level", "energy_off", "kinetic", "least_potential", "most_potential", "work",
    "pivot", "taken", "most_taken", "position_residual", "velocity_residual",
    # Of the steps alone.
    "h", "last_rejected", "active", "round_off", "shorter", "varied", "reach", "far", "before", "grid",
    # Of events: whether sides are known, the last one's number from 1 on, the one of a step, whether that is for a run
    # of its own; resets so far, the time of the last one, and between the first two; the longest step.
    # The time of the last event, and between the last two, or since then of the longest step.
    "armed", "fired", "next_event", "leaves", "resets", "last_reset", "first_flight", "longest",
    "last_event", "eventless",
    # Whether the member has begun before it took its lane.
    "begun",
    # How far gaps of stops were below zero, in parts of what tolerances allow.
    "sunk",
    # The time of the next frame; infinite where there is none.
    "next_frame",
)  # fmt: skip
COLUMN = {name: index for index, name in enumerate(COLUMNS)}

TOO_MANY_STEPS, LEFT = -10, -11  # LEFT: for a run of its own
