r"""The electromechanical actuator with the Maxon motor, rearranged by hand, as one would without this library.

With the speed of the motor $N\omega$, its current $(V_s - K N \omega)/R$ and the slope $l'$ of the cam,

$$\left(J_m N^2 + J_c\right)\dot\omega = N (K i - C N \omega) - A_m l' p, \quad \dot V = A_m l' \omega - A_s v, \quad
p = K_f V + C_f \dot V, \quad M \dot v = A_s p - C_p v - k x.$$

The states are those that the library chooses: volume taken up by the line, travel and speed of the slave, angle and
speed of the cam.
"""

from collections.abc import Mapping
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

from acausal import Rodas5P
from components.rotational import EccentricDisc, PlanetaryGearbox
from studies.actuators import ElectromechanicalActuator, spring_rate

STATES = ("line.V", "slave.rod.s", "piston.v", "gearbox.carrier.phi", "cam.w")
NOMINALS = np.array([1e-8, 1e-2, 1e-1, 1.0, 10.0])
STROKE = 12e-3  # m, travel of the slave at which the clutch is open
LONGEST = 5.0  # s
OPENING_TIME = 0.08345388161694349  # s, of two other integrators that agree to 3e-12 s


def parameters(m: ElectromechanicalActuator) -> dict[str, Any]:
    """The parameters of the equations, from those of a model."""
    assert m.motor.bearing is not None
    assert isinstance(m.cam.profile, EccentricDisc)
    assert isinstance(m.gearbox, PlanetaryGearbox)
    return {
        "Vs": m.supply.V, "K": m.motor.emf.k, "R": m.motor.resistor.R, "C": m.motor.bearing.C, "Jm": m.motor.rotor.J,
        "N": m.gearbox.ratio, "Jg": m.gearbox.J_sun, "Jc": m.cam.J, "e": m.cam.profile.eccentricity,
        "rc": m.cam.profile.radius, "bore_m": m.master.bore, "bore_s": m.slave.bore, "Kf": m.line.stiffness,
        "Cf": m.line.damping, "M": m.piston.m, "Cp": m.seal.C, "k": spring_rate(m),
    }  # fmt: skip


def rates(y: Any, p: Mapping[str, Any], xp: Any) -> list[Any]:
    """The derivatives of the states; `xp` is a module that has sin, cos and sqrt."""
    volume, x, v, angle, w = (y[i] for i in range(5))
    area_m, area_s = np.pi / 4 * p["bore_m"] ** 2, np.pi / 4 * p["bore_s"] ** 2
    e, n, sine, cosine = p["e"], p["N"], xp.sin(angle), xp.cos(angle)
    slope = e * sine * (1 - e * cosine / xp.sqrt(p["rc"] ** 2 - (e * sine) ** 2))
    flow = area_m * slope * w - area_s * v
    pressure = p["Kf"] * volume + p["Cf"] * flow
    current = (p["Vs"] - p["K"] * n * w) / p["R"]
    torque = n * (p["K"] * current - p["C"] * n * w) - area_m * slope * pressure
    inertia = (p["Jm"] + p["Jg"]) * n**2 + p["Jc"]
    return [flow, v, (area_s * pressure - p["Cp"] * v - p["k"] * x) / p["M"], w, torque / inertia]


def vector_field(t: Any, y: Any, p: Mapping[str, Any]) -> Any:
    """The right-hand side for diffrax."""
    return jnp.stack(rates(y, p, jnp))


def opening_time(p: Mapping[str, Any], rtol: Any, solver: diffrax.AbstractSolver | None = None) -> Any:
    """As `studies.opening_time`, with the same tolerances and event; by default with the same solver, too."""
    solver = Rodas5P() if solver is None else solver
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(vector_field), solver, 0.0, LONGEST, None, jnp.zeros(5), p,
        saveat=diffrax.SaveAt(t1=True), max_steps=4096, adjoint=diffrax.DirectAdjoint(), throw=False,
        stepsize_controller=diffrax.PIDController(
            rtol=rtol, atol=rtol * NOMINALS, dtmin=1e-14 * LONGEST, force_dtmin=False
        ),
        event=diffrax.Event(lambda t, y, args, **_: y[1] - STROKE, optx.Newton(rtol=1e-13, atol=1e-15)),
    )  # fmt: skip
    assert solution.ts is not None
    assert solution.event_mask is not None
    return jnp.where(jnp.asarray(solution.event_mask), solution.ts[0], jnp.inf)


def device_parameters(model: ElectromechanicalActuator) -> dict[str, Any]:
    """The parameters as arrays on the device, as the compiled functions take them."""
    return jax.tree_util.tree_map(jnp.asarray, parameters(model))
