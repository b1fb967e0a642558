"""Where everything lies in a recording: entity paths, property names, column names, timelines."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from symgen.runtime.errors import RuntimeModelError


class RecordingError(RuntimeModelError):
    """A file is not a recording that can be read; the text says why and what to do."""


APPLICATION_ID = "symgen"
FORMAT = 1

FRAME = "frame"  # timeline: number of the frame
SIM_TIME = "sim_time"  # timeline: simulated time, rounded to nanoseconds; the exact t is a state column

WORLD = "world"
BODIES = "world/bodies"
TRAILS = "world/trails"
LABELS = "world/labels"
ORIGIN = "world/origin"
EYE = "world/eye/fixed"
FOLLOWING_EYE = "world/eye/following"
JOINTS = "world/joints"
JOINT_AXES = "world/axes"
POINTS = "world/points"
GROUND = "world/ground"
GEARS = "world/gears"
SPRINGS = "world/springs"  # and dampers
LINKS = "world/links"
FORCES = "world/forces"
REACTIONS = "world/reactions"
ABOUT = "about"
STATE = "state"
EVENTS = "events"
PLOTS = "plots"
ENERGY = "plots/energy"
BALANCE = "plots/energy_balance_error"
RESIDUAL = "plots/constraint_residual"
MULTIPLIERS = "plots/multipliers"
STEP_SIZE = "plots/step_size"
EQUAL_STEPS = "plots/step_size/all_equal"

STATE_ARCHETYPE = "symgen.State"
STATE_COLUMNS = (
    "t",
    "q",
    "v",
    "w",
    "lambda",
    "settings",
)  # settings: of stops and frictions, where there are such
CHUNK_ARCHETYPE = "symgen.States"  # of states alone: the same columns, but a row holds all frames of a chunk
EVENT_ARCHETYPE = "symgen.Event"
CHECKPOINT = "checkpoint"
CHECKPOINT_ARCHETYPE = "symgen.Checkpoint"

# Recording properties.
MODEL = "model"
RUN = "run"
PARAMETERS = "parameters"
INPUTS = "inputs"
INPUTS_OVER_TIME = "inputs_over_time"
VERSIONS = "versions"
MEMBERS = "members"  # of a recording of several members of an ensemble, which holds no states
CONTENTS = ALL, STATES = ("all", "states")  # what a recording holds: all that is shown, or states alone
RESULT = "result"  # written last: a recording without it is of a run that was cut short

PALETTE = (
    (78, 121, 167),
    (242, 142, 43),
    (89, 161, 79),
    (225, 87, 89),
    (118, 183, 178),
    (237, 201, 72),
    (176, 122, 161),
    (255, 157, 167),
    (156, 117, 95),
    (186, 176, 172),
)
"""Ten colours that stay apart on dark and on light grounds (Tableau 10)."""

MARK_COLOURS = {
    "pin": (208, 211, 217),
    "slide": (208, 211, 217),
    "ball": (208, 211, 217),
    "gear": (208, 211, 217),
    "point": (255, 226, 120),
    "ground": (150, 155, 165),
    "plane": (110, 115, 125),
    "surface": (110, 115, 125),
    "rail": (150, 155, 165),
    "link": (170, 175, 185),
    "spring": (196, 200, 208),
    "damper": (160, 166, 178),
    "force": (255, 96, 80),
    "torque": (255, 160, 60),
    "reaction": (120, 200, 255),
    "tension": (120, 200, 255),
}
AXIS_COLOUR = (120, 170, 220)


def colour(index: int) -> tuple[int, int, int]:
    """Return the colour of the `index`-th body or curve."""
    return PALETTE[index % len(PALETTE)]


def state_bytes(columns: dict[str, np.ndarray]) -> bytes:
    """Return the rows (t, q, v, w, lambda, settings) as little-endian float64: what the SHA-256 is taken of."""
    rows = np.column_stack([columns[name] for name in STATE_COLUMNS])
    return np.ascontiguousarray(rows, dtype="<f8").tobytes()


class FileDigest:
    """The SHA-256 of the first bytes of a file, which may grow meanwhile.

    Attributes
    ----------
    n_bytes : int
        How many it is of so far.
    """

    def __init__(self, path: Path):
        self._path, self._digest, self.n_bytes = path, hashlib.sha256(), 0

    def extend(self, n_bytes: int) -> str:
        """Take it of the first `n_bytes`, and return it as hexadecimal digits."""
        with self._path.open("rb") as file:
            file.seek(self.n_bytes)
            while (left := n_bytes - self.n_bytes) > 0 and (part := file.read(min(left, 1 << 20))):
                self._digest.update(part)
                self.n_bytes += len(part)
        return self._digest.hexdigest()


def state_sha256(columns: dict[str, np.ndarray]) -> str:
    """Return the SHA-256 of the state columns, as hexadecimal digits."""
    return hashlib.sha256(state_bytes(columns)).hexdigest()
