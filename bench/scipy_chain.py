"""The Wiener-Hammerstein chain of derivatives_bench in scipy: prints its best time in seconds, writes its output.

usage: scipy_chain.py BASE   reads BASE.u (float64) and BASE.theta (three lines), writes BASE.y (float64)
"""

import sys
import time

import numpy
from scipy.signal import lfilter

base = sys.argv[1]
u = numpy.fromfile(base + ".u")
with open(base + ".theta") as file:
    first, powers, second = [numpy.array([float(x) for x in line.split()]) for line in file]


def rational(theta):
    return theta[:4], numpy.concatenate([[1.0], theta[4:]])


def chain():
    v = lfilter(*rational(first), u)
    w = numpy.polyval(powers[::-1], v)
    return lfilter(*rational(second), w)


best = float("inf")
for _ in range(15):
    start = time.thread_time()
    y = chain()
    best = min(best, time.thread_time() - start)
y.tofile(base + ".y")
print(best)
