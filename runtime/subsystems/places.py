"""Where the values of the members of one kind of subsystem stand in the arrays of the whole model."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

# What the functions write, in order, as (rows, columns): an axis joins vectors over coordinates (q), rates (v),
# holonomic constraints (h) and all constraints (c); a vector has one column. POWER and RATIO are numbers that all
# subsystems make together, as are both energies.
POWER, RATIO, ENERGY = "power", "ratio", "energy"
LAYOUTS: dict[str, tuple] = {
    "rhs": (("q", ""), ("v", ""), POWER, ("c", ""), RATIO),
    "kinematics": (("q", "v"), ("q", "q")),
    "mass_matrix": (("v", "v"),),
    "forces": (("v", ""),),
    "energy": (ENERGY, ENERGY),
    "residual": (("vc", ""),),
    "residual_jacobian": (("vc", "qvvc"),),
    "constraint_residual": (("hc", ""),),
    "constraint_jacobian": (("c", "v"),),
    "gamma": (("c", ""),),
    "project": (("qvhc", ""),),
}
_EXTENDED = ("residual", "residual_jacobian")


class Places:
    """Places of all members of one kind.

    Parameters
    ----------
    kind : mapping
        An entry of the header's `subsystems`.
    header : mapping
        Of the whole model.

    Attributes
    ----------
    count : int
        Number of members.
    vectors : dict of str to ndarray, shape (count, length)
        Indices in the whole model by letter.
    """

    def __init__(self, kind: Mapping, header: Mapping):
        self.count = len(kind["rates"])
        as_table = {"q": "coordinates", "v": "rates", "c": "constraints"}
        self.vectors = {
            x: np.array(kind[key], dtype=int).reshape(self.count, -1) for x, key in as_table.items()
        }
        nh, m = header["nh"], header["nh"] + header["nn"]
        holonomic = self.vectors["c"] < nh
        self.vectors["h"] = self.vectors["c"][:, holonomic[0]]
        self._whole = {"q": header["nq"], "v": header["nv"], "h": nh, "c": m}
        self._shared = {POWER: header["nw"], RATIO: int(m > 0), ENERGY: 1}

    def read(self, function: str) -> np.ndarray:
        """Return where the members' own `y` stands in the whole model's, shape (count, length)."""
        return self._axis("qvvc" if function in _EXTENDED else "qv")[0]

    def written(self, function: str, own: Mapping[str, int]) -> np.ndarray:
        """Return where the members' own `out` stands in the whole model's, shape (count, length).

        Parameters
        ----------
        own : mapping of str to int
            Whether a member writes POWER, RATIO and ENERGY by itself: 0 or 1.
        """
        found, offset = [], 0
        for block in LAYOUTS[function]:
            if block in self._shared:
                found += [np.full((self.count, 1), offset)] * own[block]
                offset += self._shared[block]
                continue
            rows, n_rows = self._axis(block[0])
            columns, n_columns = (
                self._axis(block[1]) if block[1] else (np.zeros((self.count, 1), dtype=int), 1)
            )
            places = offset + rows[:, :, None] * n_columns + columns[:, None, :]
            found.append(places.reshape(self.count, -1))
            offset += n_rows * n_columns
        return np.hstack(found) if found else np.zeros((self.count, 0), dtype=int)

    def _axis(self, letters: str) -> tuple[np.ndarray, int]:
        found, offset = [], 0
        for letter in letters:
            found.append(offset + self.vectors[letter])
            offset += self._whole[letter]
        return np.hstack(found), offset
