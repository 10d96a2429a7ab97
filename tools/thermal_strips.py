"""Temperature and traction along a contact with thermal softening: the reference solver.

It checks the closed form of `contactlib.laws.ThermalContact` and never runs in a simulation.
``python tools/thermal_strips.py PICTURE`` draws the guide's example.

Units are those of `laws.cohesive_zone`: lengths in a, tractions in f p0, creepage x in zeta0, where
f is friction at the temperature at which the surfaces enter. Behind the stick boundary, at
y = sqrt(c - xi) = Y tau, friction is f F(T), so that e = (F - 1) p, h = (F - 1) sqrt(Y**2 - y**2).
Chebyshev polynomials take all integrals, as F is even in y:

    F - 1 = sum b_n U_2n(tau),    (1/pi) PV int h/(y' - y) dy' = -Y sum b_n T_2n+1(tau),
    A = Y**2 b_0/2,    B = Y**4 (b_0 + b_1)/4.

The flux F p sigma makes the temperature rise

    T = (k/m) int_xi^c F p sigma(eta)/sqrt(eta - xi) d eta
      = (k/m) Y int_0^(pi/2) 2 sqrt(1 - z**2) M(z) d theta,    z = tau sin(theta),
    M = F y sqrt(epsilon + y**2) sigma,

with m = `MEAN`, so that k x is the mean rise in full slip with F = 1, far beyond saturation. Only
the logarithm of T at the trailing edge is not a polynomial: errors of q fall like the fifth power
of the number of nodes.

A `k_hat` adds the Carter-Griffith law's release k_hat t to A, t = ((1 + c)/(1 - c))**(1/4). Its
fracture energy, k_hat**2 sqrt(1 - c**2) of the power q x, is spent at the stick boundary, where the
surface is cold. It contributes to the force but not to the heat, because it would make the
temperature of a point infinite; in a weakening zone of finite length it is heat as well.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from scipy.optimize import brentq

import contactlib as cl
from contactlib import figures
from contactlib.base.quantities import FloatArray
from contactlib.figures.style import (
    DASHED,
    add_caption,
    labelled,
    new_figure,
    paint,
    percent,
    styled,
)
from contactlib.laws import ContactHeat, Softening, ThermalContact
from contactlib.laws.cohesive_zone import ConvergenceError
from contactlib.laws.heat import MEAN, MEANS
from contactlib.laws.strips import double_exponential, solve_split

NODES = 32  # gives q to 1e-8
ITERATIONS = 60
NO_K_HAT = 1e-9  # below it the law is that of Coulomb friction
STRIPS = 16  # of half an ellipse

Fall = Callable[[FloatArray], tuple[FloatArray, FloatArray]]  # F and dF/dT at T


class ThermalZone(NamedTuple):
    """State of a line contact, in the module's units; arrays from the stick boundary backwards."""

    creepage: float  # x
    traction_ratio: float  # q
    heat: float  # power that warms the surfaces, (2/pi) int F p sigma; q x where k_hat is 0
    stick_boundary: float  # c
    position: FloatArray  # xi, (n,)
    fraction: FloatArray  # F, (n,)
    temperature: FloatArray  # T, (n,)
    slip_rate: FloatArray  # sigma, (n,)
    release: float  # k_hat t
    series: FloatArray  # b, (n,)

    def stick_traction(self, position: FloatArray) -> FloatArray:
        """Traction at places c < xi <= 1, in f p0."""
        width = math.sqrt(1.0 + self.stick_boundary)  # Y
        tip = np.sqrt(position - self.stick_boundary)
        # The integral of h/(y**2 + tip**2), by the series' values at the imaginary place i tip/Y.
        steps = 2.0 * np.arange(self.series.size) + 1.0
        inner = width / (np.hypot(width, tip) + tip)
        alternating = self.series * np.cos(0.5 * np.pi * (steps - 1.0))
        pull = width / tip * (alternating * inner[..., np.newaxis] ** steps).sum(axis=-1)
        gap = np.sqrt(np.maximum(1.0 - position, 0.0)) * tip
        pressure = np.sqrt(np.maximum(1.0 - position**2, 0.0))
        return np.asarray(pressure - gap * (1.0 - pull - self.release / tip**2))


class _Rules(NamedTuple):
    """Nodes and matrices that act on values of an even function at them."""

    tau: FloatArray  # positive zeros of U_2n, (n,)
    series: FloatArray  # values to coefficients of U_0, U_2, ..., (n, n)
    principal: FloatArray  # values to the sum of b_n T_2n+1, (n, n)
    heat: FloatArray  # values M to int_0^(pi/2) 2 sqrt(1 - z**2) M(z) d theta, (n, n)


@cache
def _rules(n: int) -> _Rules:
    angle = np.pi * np.arange(n, 0, -1)[:, np.newaxis] / (2 * n + 1)
    steps = 2 * np.arange(n) + 1
    series = np.linalg.inv(np.sin(steps * angle) / np.sin(angle))
    rule = double_exponential(8 * n + 200, 3.4, 3.4)
    z = np.cos(angle) * np.cos(0.5 * np.pi * rule.from_end)
    polynomials = [(rule.weight * np.sin(step * np.arccos(z))).sum(axis=1) for step in steps]
    heat = np.pi * np.transpose(polynomials) @ series
    return _Rules(np.cos(angle)[:, 0], np.asarray(series), np.cos(steps * angle) @ series, heat)


class _Contact(NamedTuple):
    """Parameters of a state."""

    k_hat: float
    rise: float  # k [K]
    fall: Fall
    nodes: int

    def state(self, m: float, s: float, release: float, edge: float) -> ThermalZone:
        """State at c = m - s, m + s = 1, with the slip rate `edge` at the leading edge."""
        rules = _rules(self.nodes)
        width = math.sqrt(2.0 * m)
        y = width * rules.tau
        root = 2.0 * s + y * y
        weight = self.rise / MEAN * width * rules.heat
        slides = root * (release + y * y) + edge * y * y  # M/F for F = 1
        bends = (root * y)[:, np.newaxis] * (width * rules.principal)
        fraction = np.ones_like(y)
        for _ in range(ITERATIONS):
            source = slides + bends @ (fraction - 1.0)
            temperature = weight @ (fraction * source)
            target, slope = self.fall(temperature)
            left = fraction - target
            if np.abs(left).max() < 1e-13:
                break
            by_fraction = np.diag(source) + fraction[:, np.newaxis] * bends
            matrix = np.eye(y.size) - slope[:, np.newaxis] * (weight @ by_fraction)
            fraction = fraction - np.linalg.solve(matrix, left)
        else:
            raise ConvergenceError(
                f"temperature and friction at k_hat {self.k_hat:.4g}, rise {self.rise:.4g} K do "
                f"not converge: the residual is {np.abs(left).max():.2e} after {ITERATIONS} steps"
            )
        b = rules.series @ (fraction - 1.0)
        released = release + m * b[0]
        flux = rules.series[0] @ (fraction * source)  # the mean of M
        return ThermalZone(
            creepage=m + edge + released,
            traction_ratio=m * (1.0 + s) + 2.0 * s * released + m * m * (b[0] + b[1]),
            heat=float(2.0 * m * flux),
            stick_boundary=m - s,
            position=m - s - y * y,
            fraction=fraction,
            temperature=temperature,
            slip_rate=source / (y * np.sqrt(root)),
            release=release,
            series=b,
        )


def solve_thermal_zone(
    x: float, *, rise: float, fall: Fall, k_hat: float = 0.0, nodes: int = NODES
) -> ThermalZone:
    """Solve the contact at a creepage x > 0.

    Raises
    ------
    ConvergenceError
        If the iteration does not converge.
    """
    contact = _Contact(k_hat, rise, fall, nodes)

    def of_log_t(log_t: float) -> ThermalZone:
        fourth = math.exp(-4.0 * log_t)  # s/m
        m = 1.0 / (1.0 + fourth)
        return contact.state(m, fourth * m, k_hat * math.exp(log_t), 0.0)

    def in_full_slip(edge: float) -> ThermalZone:
        return contact.state(1.0, 0.0, 0.0, edge)

    def in_partial_slip(m: float) -> ThermalZone:
        return contact.state(m, 1.0 - m, 0.0, 0.0)

    at: Callable[[float], ThermalZone]
    # Friction that falls takes less creepage for the same stick zone, but by no more than 1.
    if k_hat >= NO_K_HAT:
        _, _, y = solve_split(np.array([x]), np.array([k_hat]))
        at, low, high = of_log_t, math.log(y[0] / k_hat), math.log((x + 1.0) / k_hat)
    elif x >= in_full_slip(0.0).creepage:
        at, low, high = in_full_slip, max(x - 1.0, 0.0), x
    else:
        at, low, high = in_partial_slip, x, 1.0
    if at(low).creepage >= x:  # equal to rounding
        return at(low)
    if at(high).creepage <= x:
        return at(high)
    place = brentq(lambda v: at(v).creepage - x, low, high, xtol=1e-15 * x, rtol=1e-15)
    return at(float(place))


# ---- a contact in SI units ----


class ThermalStrip(NamedTuple):
    """A strip from its leading to its trailing edge; arrays (n,)."""

    position: FloatArray  # x/a [1]
    temperature: FloatArray  # above ambient [K]
    friction_coefficient: FloatArray  # [1]
    shear_traction: FloatArray  # [Pa]
    slip_speed: FloatArray  # [m/s]
    heat_flux: FloatArray  # into both bodies [W/m^2]


def _zone(
    contact: ThermalContact, creepage: float, speed: float, w: float, nodes: int = NODES
) -> tuple[ThermalZone, float, float]:
    """Strip of relative half-width w; temperature and F where it begins."""
    x, enters, left, rise = (float(v) for v in contact._entry(creepage, speed))

    def fall(warmer: FloatArray) -> tuple[FloatArray, FloatArray]:
        at = enters + warmer
        return contact.softening.fraction(at) / left, contact.softening.slope(at) / left

    zone = solve_thermal_zone(
        abs(x) / w,
        rise=rise * MEAN / MEANS[contact.heat.shape] * w**2.5,
        fall=fall,
        k_hat=contact.k_hat / (math.sqrt(left) * w),
        nodes=nodes,
    )
    return zone, enters, left


def solve_strip(contact: ThermalContact, creepage: float, speed: float) -> ThermalStrip:
    """Solve the middle strip at a creepage, which must not be 0.

    Raises
    ------
    ConvergenceError
        If the iteration does not converge.
    """
    zone, enters, left = _zone(contact, creepage, speed, 1.0, 3 * NODES)  # for curves
    c, xi = zone.stick_boundary, zone.position
    ahead = c + (1.0 - c) * np.sin(np.linspace(0.5 * np.pi, 0.01, 60 if c < 1.0 else 0)) ** 2

    def along(sticking: float, sliding: FloatArray) -> FloatArray:
        return np.append(np.full_like(ahead, sticking), sliding)

    friction = math.copysign(contact.friction.kinetic * left, creepage)
    sliding = np.sqrt((1.0 - xi) * (1.0 + xi)) * zone.fraction
    traction = np.append(zone.stick_traction(ahead), sliding)
    traction *= friction * contact.heat.contact.peak_pressure
    slip_speed = along(0.0, contact.saturation_creepage * left * speed * zone.slip_rate)
    slip_speed = np.copysign(slip_speed, creepage)
    return ThermalStrip(
        position=np.append(ahead, xi),
        temperature=enters + along(0.0, zone.temperature),
        friction_coefficient=abs(friction) * along(1.0, zone.fraction),
        shear_traction=traction,
        slip_speed=slip_speed,
        heat_flux=traction * slip_speed,
    )


def local_traction_coefficient(
    contact: ThermalContact, creepage: ArrayLike, speed: float
) -> FloatArray:
    """Q/P [1] at creepages, 2 ms each and 30 ms in an ellipse.

    Raises
    ------
    ConvergenceError
        If the iteration does not converge.
    """
    strips = [(1.0, 1.0)]
    if contact.heat.shape == "elliptic":
        nodes, weights = np.polynomial.legendre.leggauss(STRIPS)
        width = np.cos(0.25 * np.pi * (nodes + 1.0))
        strips = list(zip(width.tolist(), 0.375 * np.pi * weights * width**3, strict=True))
    coefficients = []
    for zeta in np.ravel(creepage).tolist():
        zones = [(weight, *_zone(contact, zeta, speed, w)) for w, weight in strips]
        ratio = sum(weight * zone.traction_ratio for weight, zone, *_ in zones)
        coefficients.append(math.copysign(contact.friction.kinetic * zones[0][3] * ratio, zeta))
    return np.reshape(coefficients, np.shape(creepage))


# ---- the guide's picture ----

ALONG = (
    "Shear traction and temperature along the middle of a contact at {speed:g} m/s. Surfaces enter "
    "at the right, stick, and slip behind the stick boundary; there friction bounds the traction "
    "and warms the surface, and friction is lower where it is warmer. The dashed line is the bound "
    "of cold friction."
)


def draw_strips(contact: ThermalContact, creepages: tuple[float, ...], speed: float) -> Figure:
    """Draw shear traction and temperature along the middle strip at up to three creepages."""
    with styled():
        figure, (left, right) = new_figure(9.6, 4.6, ncols=2)
        xi = np.linspace(-1.0, 1.0, 401)
        bound = contact.friction.kinetic * 1e-6 * contact.heat.contact.peak_pressure
        left.plot(xi, bound * np.sqrt(1.0 - xi**2), color=paint.grey, lw=1.0, ls=DASHED)
        for creepage, (color, width) in zip(creepages, paint.three, strict=False):
            strip = solve_strip(contact, creepage, speed)
            look = {"color": color, "lw": width, "label": f"creepage {percent(abs(creepage))}"}
            left.plot(strip.position, 1e-6 * np.abs(strip.shear_traction), **look)
            right.plot(strip.position, strip.temperature, **look)
        place, limits = "position $x/a$  [1], leading edge at 1", (-1.0, 1.0)
        labelled(left, place, "shear traction  [MPa]", xlim=limits, ylim=(0.0, None))
        top = 1.3 * right.get_ylim()[1]  # room for the legend
        legend, height = {"loc": "upper right"}, (0.0, top)
        temperature = "temperature above ambient  [K]"
        labelled(right, place, temperature, xlim=limits, ylim=height, legend=legend)
        add_caption(figure, ALONG.format(speed=speed))
    return figure


def example() -> ThermalContact:
    """The contact of the guide's page on heat, fitted to the locomotive Eurosprinter."""
    wheel = cl.EllipticContact.from_semi_axes(
        semi_axis_x=6.304e-3,
        semi_axis_y=12.61e-3,
        wheel_load=106.7e3,
        contact_modulus=82e9 / 0.72,
        poisson_ratio=0.28,
    )
    heat = ContactHeat(contact=wheel)
    data = cl.TractionData.from_csv(cl.files.model_path("eurosprinter_engel1998.csv"), speed=10.0)
    value = cl.fit(cl.CarterGriffith, data, contact="elliptic", heat=heat, k_hat=0.0).values
    friction = cl.Friction(static=value["kinetic"], kinetic=value["kinetic"], weakening_length=0.0)
    clean = cl.laws.saturation_creepage(wheel, friction)
    return ThermalContact(
        heat=heat,
        friction=friction,
        softening=Softening.linear(value["softening_temperature"]),
        slope_reduction=clean / value["saturation_creepage"],
    )


if __name__ == "__main__":
    figures.save(draw_strips(example(), (0.003, 0.02, 0.2), 10.0), sys.argv[1])
