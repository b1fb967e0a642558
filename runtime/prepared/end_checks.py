"""What is checked of a run in machine code: energies at its frames, constraints at its end, events passed by."""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import copy
from symgen.runtime.prepared import layout as here


@jitted
def balance_is_kept(n_frames, loop, plan, look):
    """Whether the energy balance at the first frames is as the health report wants it; the end meets the constraints.

    Frames tell what the motion exchanges, in parts of which the balance counts (`exchange.py`): the largest |T| or the
    range of V. What resets did before them is no error. Where this says no the whole report has the last word.
    """
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    first = kinetic = off = 0.0
    least, most = math.inf, -math.inf
    for k in range(n_frames):
        copy(loop.frames[k][:n], look.y)
        call_kernel(plan.addresses[here.ENERGY], loop.frame_times[k], look.y, loop.p, look.energy)
        balance = look.energy[0] + look.energy[1] - look.resets[k]
        for j in range(n, loop.frames.shape[1]):
            balance -= loop.frames[k, j]
        if k == 0:
            first = balance
        kinetic = max(kinetic, abs(look.energy[0]))
        least, most = min(least, look.energy[1]), max(most, look.energy[1])
        if not abs(balance - first) <= off:
            off = abs(balance - first)
    exchange = max(kinetic, most - least)
    taken = loop.control[at.MOST_ENERGY_TAKEN]
    if not max(off, taken) <= plan.asked[here.ENERGY_LIMIT] * exchange:
        return off == 0.0 and taken == 0.0
    if loop.sizes[at.NM] == 0:
        return True
    copy(loop.y[:n], look.y)
    call_kernel(plan.addresses[here.RESIDUAL], loop.control[at.T], look.y, loop.p, look.residual)
    return constraints_are_met(loop, plan, look.residual)


@jitted
def events_are_seen(loop):
    """Whether no step has come across a crossing that did not fire (`checks/missed_events.py`)."""
    ne = loop.sizes[at.NE]
    for e in range(ne):
        if loop.control[at.N_CONTROL + at.PASSED * ne + e] > 0.0:
            return False
    return True


@jitted
def constraints_are_met(loop, plan, residual):
    """Whether residuals are small beside what the characteristic sizes change, rates as `drift.py` has them."""
    nq, nv, nh, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NH], loop.sizes[at.NM]
    per_residual, sizes = plan.weights[m * nv : m * nv + m], plan.weights[m * nv + m :]
    pace = 1.0 / (plan.asked[here.T_END] - loop.control[at.T_START])
    for j in range(nv):
        pace = max(pace, abs(loop.y[nq + j]) / sizes[j])
    for i in range(m):
        if i < nh and not abs(residual[i]) * per_residual[i] <= plan.asked[here.DRIFT_LIMIT]:
            return False
        if not abs(residual[nh + i]) * per_residual[i] <= plan.asked[here.DRIFT_LIMIT] * pace:
            return False
    return True
