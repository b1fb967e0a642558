"""Where a driven system keeps its inputs: the numbers behind a precomputed `p` that its kernels work on.

There is a block for each input in pieces: whether the piece in use is fixed, the number of pieces, where they are
kept, and the piece in use, its knot and coefficients. In a run where no step reaches over a break, the piece is known
beforehand, and the end of a step before a jump sees the value before it. Elsewhere the piece is searched for at the
time of each call. Then comes a block for each continuous controller (its address, what it reads, outputs, what it
gives); behind all blocks, the knots and coefficients of all pieces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from symgen.runtime.inputs.given import Pieces

FIXED, COUNT, FIRST, KNOT, COEFFICIENTS = range(5)  # within the block of an input in pieces


@dataclass(frozen=True)
class PiecesPlace:
    """Of an input in pieces: its number, where its block begins, and its polynomials' degree."""

    number: int
    block: int
    degree: int

    @property
    def width(self) -> int:
        """Coefficients of a piece."""
        return self.degree + 1


@dataclass(frozen=True)
class FeedbackPlace:
    """Of a continuous controller: its inputs' numbers, what it reads, and where its cells are.

    Attributes
    ----------
    inputs : tuple of int
    reads : tuple of int
        As `controller.Signals` has it.
    address, signals, outputs, values : int
        Where its address, what it reads, the model's outputs and what it gives are kept.
    """

    inputs: tuple[int, ...]
    reads: tuple[int, ...]
    address: int
    signals: int
    outputs: int
    values: int


@dataclass(frozen=True)
class Places:
    """All blocks.

    Attributes
    ----------
    first_input : int
        The place of input 0 in `p`.
    n_inputs : int
    pieces : tuple of PiecesPlace
    feedback : tuple of FeedbackPlace
    end : int
        Where the knots of all pieces begin.
    """

    first_input: int
    n_inputs: int
    pieces: tuple[PiecesPlace, ...]
    feedback: tuple[FeedbackPlace, ...]
    end: int


def lay_out(
    n_parameters: int,
    n_inputs: int,
    n_precomputed: int,
    degrees: Sequence[tuple[int, int]],
    controllers: Sequence[tuple[tuple[int, ...], tuple[int, ...]]],
    n_outputs: int,
) -> Places:
    """Return the places for inputs in pieces, (number, degree) each, and controllers, (inputs, reads) each."""
    end = n_precomputed
    pieces, feedback = [], []
    for number, degree in degrees:
        pieces.append(PiecesPlace(number, end, degree))
        end += COEFFICIENTS + degree + 1
    for inputs, reads in controllers:
        outputs = end + 1 + len(reads)
        values = outputs + (n_outputs if any(place < 0 for place in reads) else 0)
        feedback.append(FeedbackPlace(inputs, reads, end, end + 1, outputs, values))
        end = values + len(inputs)
    return Places(n_parameters, n_inputs, tuple(pieces), tuple(feedback), end)


def fill(
    places: Places, longer: np.ndarray, all_pieces: Sequence[Pieces], addresses: Sequence[int]
) -> np.ndarray:
    """Return a precomputed `p` with the blocks and pieces behind it; pieces are searched for."""
    blocks = np.zeros(places.end - len(longer))
    tables, first = [], places.end
    for place, pieces in zip(places.pieces, all_pieces):
        block = place.block - len(longer)
        blocks[block + COUNT], blocks[block + FIRST] = len(pieces.knots), first
        tables += [pieces.knots, pieces.coefficients.ravel()]
        first += len(pieces.knots) * (1 + place.width)
    for place, address in zip(places.feedback, addresses):
        blocks.view(np.uint64)[place.address - len(longer)] = address
    return np.concatenate([longer, blocks, *tables])


def fix_piece(place: PiecesPlace, precomputed: np.ndarray, pieces: Pieces, t: float) -> None:
    """Put the piece that begins or holds at `t` into use, whatever the time of a call."""
    k = pieces.piece_at(t)
    precomputed[place.block + FIXED] = 1.0
    precomputed[place.block + KNOT] = pieces.knots[k]
    precomputed[place.block + COEFFICIENTS :][: place.width] = pieces.coefficients[k]
