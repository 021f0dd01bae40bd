"""Least squares over localising filters in scipy: prints its best time in seconds and the condition number.

usage: scipy_localising.py BASE   reads BASE.u, BASE.y (float64) and BASE.points (sample time, then break points)

F_k = p_k / (s + p_k) prod_{l<k} s / (s + p_l), each factor by Tustin's rule, initial states as impulse responses.
"""

import sys
import time

import numpy
from scipy.signal import lfilter

base = sys.argv[1]
u = numpy.fromfile(base + ".u")
y = numpy.fromfile(base + ".y")
with open(base + ".points") as file:
    step, *points = [float(x) for x in file.read().split()]


def bank(v):
    columns = []
    for p in points:
        a = [1.0 + 0.5 * step * p, -1.0 + 0.5 * step * p]
        columns.append(lfilter([0.5 * step * p, 0.5 * step * p], a, v))
        v = lfilter([1.0, -1.0], a, v)
    return columns


def fit():
    impulse = numpy.zeros_like(u)
    impulse[0] = 1.0 / step
    x = numpy.column_stack([-column for column in bank(y)] + bank(u) + bank(impulse))
    norms = numpy.linalg.norm(x, axis=0)
    theta, _, _, singular = numpy.linalg.lstsq(x / norms, y, rcond=None)
    return theta / norms, (singular[0] / singular[-1]) ** 2


best = float("inf")
for _ in range(5):
    start = time.thread_time()
    _, condition = fit()
    best = min(best, time.thread_time() - start)
print(best, condition)
