"""Parameters of the generalised-α method and of HHT."""

from typing import NamedTuple


class GeneralizedAlpha(NamedTuple):
    """Parameters of the generalised-α method for q'' = a(t, q, v).

    A runs behind a as an average, (1 - α_m) A₁ + α_m A₀ = (1 - α_f) a₁ + α_f a₀, and Newmark's formulas take A:
    v₁ = v₀ + h ((1-γ) A₀ + γ A₁), q₁ = q₀ + h v₀ + h² ((1/2-β) A₀ + β A₁).

    Attributes
    ----------
    alpha_m, alpha_f, beta, gamma : float
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float


class ConstrainedAlpha(NamedTuple):
    """Parameters as those of `GeneralizedAlpha`, for constraints on positions.

    Attributes
    ----------
    alpha_m, alpha_f, beta, gamma : float
    stabilised : int
        1 where constraints hold for velocities as well (stabilised index 2), 0 in index-3 form.
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    stabilised: int


def generalized_alpha(spectral_radius: float = 0.9) -> GeneralizedAlpha:
    """Return the method that damps the fastest motions by `spectral_radius`, 0 to 1, a step, and slow ones least.

    Chung, Hulbert, J. Appl. Mech. 60 (1993) 371, (14), (20) and (25).
    """
    rho = spectral_radius
    return _newmark((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0))


def hht(alpha: float = 0.1) -> GeneralizedAlpha:
    """Return the method of Hilber, Hughes and Taylor with α, 0 to 1/3; damping grows with it.

    Hilber, Hughes, Taylor, Earthq. Eng. Struct. Dyn. 5 (1977) 283, whose α is negative.
    """
    return _newmark(0.0, alpha)


def _newmark(alpha_m: float, alpha_f: float) -> GeneralizedAlpha:
    if not alpha_m <= alpha_f <= 0.5:
        raise ValueError(
            f"the method is unstable with α_m = {alpha_m}, α_f = {alpha_f}: α_m <= α_f <= 1/2 is needed"
        )
    lag = alpha_f - alpha_m
    return GeneralizedAlpha(alpha_m, alpha_f, 0.25 * (1.0 + lag) ** 2, 0.5 + lag)
