"""Double pendulum in high precision by Taylor series: makes tests/reference/double_pendulum.json.

Run `python tests/oracles/double_pendulum_series.py` to write the file anew (about a minute).
"""

from __future__ import annotations

import json
from pathlib import Path

from mpmath import mp, mpf

TIMES = (1, 2, 5, 10)


class Series:
    """Taylor coefficients of the motion about one time, extended by one order at a time.

    With m = L = 1 and d = theta1 - theta2 the accelerations a, b fulfil
    2 a + b cos d = -w2^2 sin d - 2 g sin theta1 and a cos d + b = w1^2 sin d - g sin theta2.
    """

    def __init__(self, state: list[mpf], gravity: mpf) -> None:
        self.gravity = gravity
        self.angles = [[state[0]], [state[1]]]
        self.rates = [[state[2]], [state[3]]]
        self.accelerations: list[list[mpf]] = [[], []]
        self.sines = [_SineCosine(), _SineCosine(), _SineCosine()]  # of theta1, theta2, d
        self.squares: list[list[mpf]] = [[], []]  # of the rates
        self.top: list[mpf] = []  # right-hand sides of the two equations
        self.bottom: list[mpf] = []
        self.determinant: list[mpf] = []

    def extend(self) -> None:
        """Find the next coefficient of the accelerations, then of rates and angles."""
        k = len(self.accelerations[0])
        first, second = self.angles
        self.sines[0].extend(first)
        self.sines[1].extend(second)
        self.sines[2].extend([x - y for x, y in zip(first, second, strict=True)])
        s, c = self.sines[2].sine, self.sines[2].cosine
        for square, rate in zip(self.squares, self.rates, strict=True):
            square.append(_product(rate, rate, k))
        self.top.append(-_product(self.squares[1], s, k) - 2 * self.gravity * self.sines[0].sine[k])
        self.bottom.append(_product(self.squares[0], s, k) - self.gravity * self.sines[1].sine[k])
        self.determinant.append((2 if k == 0 else 0) - _product(c, c, k))
        right = (self.top[k] - _product(c, self.bottom, k), 2 * self.bottom[k] - _product(c, self.top, k))
        for i in range(2):
            known = sum((self.determinant[k - j] * self.accelerations[i][j] for j in range(k)), mpf(0))
            self.accelerations[i].append((right[i] - known) / self.determinant[0])
            self.rates[i].append(self.accelerations[i][k] / (k + 1))
            self.angles[i].append(self.rates[i][k] / (k + 1))

    def step_size(self, digits: int) -> mpf:
        """Step for which the last two coefficients of the angles stay below 10^-digits."""
        largest = [max(abs(self.angles[0][k]), abs(self.angles[1][k])) for k in range(len(self.angles[0]))]
        orders = [k for k in range(len(largest) - 3, len(largest)) if largest[k] > 0]
        return min((mpf(10) ** -digits / largest[k]) ** (mpf(1) / k) for k in orders)

    def at(self, h: mpf) -> list[mpf]:
        """The state after a time h."""
        return [mp.polyval(coefficients[::-1], h) for coefficients in (*self.angles, *self.rates)]


class _SineCosine:
    """Series of the sine and cosine of a series."""

    def __init__(self) -> None:
        self.sine: list[mpf] = []
        self.cosine: list[mpf] = []

    def extend(self, angle: list[mpf]) -> None:
        k = len(self.sine)
        if k == 0:
            self.sine, self.cosine = [mp.sin(angle[0])], [mp.cos(angle[0])]
            return
        slopes = [j * angle[j] for j in range(k + 1)]
        sine = sum((slopes[j] * self.cosine[k - j] for j in range(1, k + 1)), mpf(0)) / k
        cosine = -sum((slopes[j] * self.sine[k - j] for j in range(1, k + 1)), mpf(0)) / k
        self.sine.append(sine)
        self.cosine.append(cosine)


def _product(a: list[mpf], b: list[mpf], k: int) -> mpf:
    return mp.fdot(a[: k + 1], b[k::-1])


def integrate(
    state: list[mpf], gravity: mpf, times: tuple[int, ...], order: int, digits: int
) -> list[list[mpf]]:
    """States (theta1, theta2, rates) at `times`, with the local error of the angles below 10^-digits."""
    t, states = mpf(0), []
    for end in times:
        while t < end:
            series = Series(state, gravity)
            for _ in range(order):
                series.extend()
            h = min(series.step_size(digits), end - t)
            state, t = series.at(h), t + h
        states.append(state)
    return states


def main() -> None:
    """Integrate twice, at different orders and precisions, and write the digits on which both agree."""
    results = []
    for precision, order in ((40, 32), (46, 38)):
        mp.dps = precision
        start = [mp.pi / 2, mp.pi / 2, mpf(0), mpf(0)]
        results.append(integrate(start, mpf("9.81"), TIMES, order, precision - 8))
    differences = [max(abs(a - b) for a, b in zip(*pair, strict=True)) for pair in zip(*results, strict=True)]
    reference = {
        "id": "double_pendulum",
        "title": "Double pendulum released from horizontal",
        "equations": "point masses on massless rods; absolute angles from straight down",
        "params": {"m1": "1", "m2": "1", "L1": "1", "L2": "1", "g": "9.81"},
        "ic": "both angles pi/2, at rest",
        "reference_th_then_rates": {
            str(t): [mp.nstr(x, 28) for x in state] for t, state in zip(TIMES, results[1], strict=True)
        },
        "source": "tests/oracles/double_pendulum_series.py",
        "verification": "Taylor series of order 32 with 40 digits and of order 38 with 46 digits differ by "
        + ", ".join(f"{mp.nstr(d, 2)} (t = {t})" for t, d in zip(TIMES, differences, strict=True)),
    }
    path = Path(__file__).parent.parent / "reference" / "double_pendulum.json"
    path.write_text(json.dumps(reference, indent=1) + "\n", encoding="utf-8")
    print(reference["verification"])


if __name__ == "__main__":
    main()
