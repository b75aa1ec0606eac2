#!/usr/bin/python3
"""References of coaxial-turn.yaml: two tubes of the same rest curvature, one in the other, clamped together and turned against each other at the clamp.

    phi'' = c sin phi,  phi'(L) = 0,  c = EI1 EI2 / (EI1 + EI2) kappa^2 (1/GJ1 + 1/GJ2)
is shot from the tip to the clamp. The tips snap where the angle at the clamp is largest; beyond that, phi is the rest of a whole turn.
"""
from math import degrees, radians, sin


def at_base(tip, c, length, steps=20000):
    """phi and phi' at the clamp (Runge and Kutta's fourth order)."""
    h, p, v = -length / steps, tip, 0.0
    for _ in range(steps):
        p1, v1 = v, c * sin(p)
        p2, v2 = v + h / 2 * v1, c * sin(p + h / 2 * p1)
        p3, v3 = v + h / 2 * v2, c * sin(p + h / 2 * p2)
        p4, v4 = v + h * v3, c * sin(p + h * p3)
        p, v = p + h / 6 * (p1 + 2 * p2 + 2 * p3 + p4), v + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4)
    return p, v


def halve(low, high, is_low):
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if is_low(middle) else (low, middle)
    return low


def main(ei=(60, 40), kappa=0.05, nu=0.3, length=60):
    gj = [e / (1 + nu) for e in ei]
    c = ei[0] * ei[1] / sum(ei) * kappa**2 * (1 / gj[0] + 1 / gj[1])
    base = lambda tip: at_base(tip, c, length, 2000)[0]
    fold = halve(radians(10), radians(120), lambda tip: base(tip + 1e-4) > base(tip))
    print(f"snaps at {degrees(base(fold)):.4f} degrees, the tips then at {degrees(fold):.2f}")
    for turned in (180, 279, 281):
        sign, phi = (1, radians(turned)) if turned < degrees(base(fold)) else (-1, radians(360 - turned))
        tip = halve(0, fold, lambda x: base(x) < phi)
        torque, twist = -sign * at_base(tip, c, length)[1] / (1 / gj[0] + 1 / gj[1]), sign * degrees(tip - phi) / sum(gj)
        print(f"{turned} degrees: torque {torque:.8f} N mm, inner twist {twist * gj[0]:.8f}, outer {-twist * gj[1]:.8f} degrees")


main()
