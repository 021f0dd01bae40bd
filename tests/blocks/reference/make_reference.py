#!/usr/bin/env python3
"""Writes the reference values of tests/blocks: what numpy and scipy make of filters, splines and polynomials.

    python3 -m venv /tmp/venv && /tmp/venv/bin/pip install numpy==2.4.6 scipy==1.17.1
    /tmp/venv/bin/python make_reference.py

One file for each routine, in long form: case,quantity,index,value. Values are written with 17 digits and read back bit
for bit. The first line of each file names the versions.
"""

import pathlib

import numpy as np
import scipy
from numpy.polynomial import chebyshev
from scipy import signal
from scipy.interpolate import BSpline

FOLDER = pathlib.Path(__file__).parent


def write(name, cases):
    with open(FOLDER / f"{name}.csv", "w", encoding="ascii") as file:
        file.write(f"# numpy {np.__version__}, scipy {scipy.__version__}; make_reference.py\n")
        file.write("case,quantity,index,value\n")
        for case, quantities in cases.items():
            for quantity, values in quantities.items():
                for index, value in enumerate(np.ravel(values)):
                    file.write(f"{case},{quantity},{index},{float(value)!r}\n")


def lfilter_cases(rng):
    """scipy.signal.lfilter from a non-zero state, and freqz."""
    designs = {
        "butterworth3": signal.butter(3, 0.2),
        "chebyshev4": signal.cheby1(4, 0.5, 0.35),
        "elliptic5_highpass": signal.ellip(5, 0.5, 40, 0.4, "highpass"),
        "more_poles_than_zeros": ([0.3, -0.1], np.poly([0.9, 0.5 + 0.4j, 0.5 - 0.4j, -0.2]).real),
        "more_zeros_than_poles": ([0.5, 0.2, -0.4, 0.1, 0.05], [1.0, -0.75]),
        "moving_average": ([0.25, 0.5, -0.125], [1.0]),
        "order10": signal.butter(5, [0.2, 0.6], "bandpass"),
    }
    cases = {}
    for name, (b, a) in designs.items():
        b, a = np.asarray(b, float), np.asarray(a, float)
        zi = rng.normal(size=max(len(a), len(b)) - 1)
        u = rng.normal(size=80)
        y, zf = signal.lfilter(b, a, u, zi=zi)
        w = np.array([0.0, 0.01, 0.3, 1.0, 2.0, 3.0])
        _, g = signal.freqz(b, a, worN=w)
        cases[name] = dict(b=b, a=a, zi=zi, u=u, y=y, zf=zf, omega=w, real=g.real, imag=g.imag)
    return cases


def sosfilt_cases(rng):
    """scipy.signal.sosfilt from rest: zeros, poles, gain in, output out."""
    designs = {
        "butterworth4": signal.butter(4, 0.15, output="zpk"),
        "elliptic6": signal.ellip(6, 0.3, 60, 0.3, output="zpk"),
        "chebyshev3": signal.cheby2(3, 30, 0.5, output="zpk"),
    }
    cases = {}
    for name, (z, p, k) in designs.items():
        u = rng.normal(size=120)
        y = signal.sosfilt(signal.zpk2sos(z, p, k), u)
        cases[name] = dict(
            zeros_real=z.real, zeros_imag=z.imag, poles_real=p.real, poles_imag=p.imag, gain=[k], u=u, y=y
        )
    return cases


def spline_cases(rng):
    """scipy.interpolate.BSpline, cubic, end knots four times; beyond the ends the tangents."""
    cases = {}
    for name, knots in {
        "uniform": np.linspace(-1.0, 2.0, 7),
        "given": np.array([-2.0, -1.9, -0.5, 0.0, 0.1, 3.0]),
        "two_knots": np.array([0.5, 1.5]),
    }.items():
        t = np.concatenate([[knots[0]] * 3, knots, [knots[-1]] * 3])
        c = rng.normal(size=len(knots) + 2)
        spline = BSpline(t, c, 3)
        slope = spline.derivative()
        width = knots[-1] - knots[0]
        u = np.concatenate([rng.uniform(knots[0] - 0.5 * width, knots[-1] + 0.5 * width, 90), knots])
        inside = np.clip(u, knots[0], knots[-1])
        basis = BSpline.design_matrix(inside, t, 3).toarray()
        assert np.allclose(basis @ c, spline(inside), atol=1e-13)
        y = spline(inside) + slope(inside) * (u - inside)
        cases[name] = dict(knots=knots, c=c, u=u, y=y, slope=slope(inside))
    return cases


def interpolation_cases(rng):
    """numpy.interp between the knots, straight lines beyond them."""
    cases = {}
    for name, knots in {"uniform": np.linspace(-1.0, 1.0, 5), "given": np.array([-3.0, -0.1, 0.0, 0.2, 5.0])}.items():
        v = rng.normal(size=len(knots))
        u = rng.uniform(knots[0] - 2.0, knots[-1] + 2.0, 90)
        y = np.interp(u, knots, v)
        first, last = (v[1] - v[0]) / (knots[1] - knots[0]), (v[-1] - v[-2]) / (knots[-1] - knots[-2])
        y = np.where(u < knots[0], v[0] + first * (u - knots[0]), y)
        y = np.where(u > knots[-1], v[-1] + last * (u - knots[-1]), y)
        cases[name] = dict(knots=knots, v=v, u=u, y=y)
    return cases


def chebval_cases(rng):
    """numpy.polynomial.chebyshev.chebval of the input mapped from [lower, upper] to [-1, 1], and cheb2poly's powers."""
    cases = {}
    for degree, lower, upper in [(0, -1.0, 1.0), (1, 0.0, 4.0), (3, -2.0, 0.5), (8, -1.5, 1.0), (25, -1.0, 1.0)]:
        c = rng.normal(size=degree + 1)
        u = rng.uniform(lower - 0.05 * (upper - lower), upper + 0.05 * (upper - lower), 60)
        y = chebyshev.chebval((2.0 * u - lower - upper) / (upper - lower), c)
        quantities = dict(range=[lower, upper], c=c, u=u, y=y)
        if degree <= 8:
            powers = np.polynomial.Chebyshev(c, domain=[lower, upper]).convert(
                kind=np.polynomial.Polynomial, domain=[-1, 1], window=[-1, 1]
            )
            quantities["powers"] = np.pad(powers.coef, (0, degree + 1 - len(powers.coef)))
        cases[f"degree{degree}"] = quantities
    return cases


def main():
    rng = np.random.default_rng(20240607)
    write("lfilter", lfilter_cases(rng))
    write("sosfilt", sosfilt_cases(rng))
    write("bspline", spline_cases(rng))
    write("interp", interpolation_cases(rng))
    write("chebval", chebval_cases(rng))


if __name__ == "__main__":
    main()
