#!/usr/bin/python3
"""References of the free-wire scenes that docs/references.md does not list; needs numpy and scipy, prints them all.

A special Cosserat rod (bending, twist, stretch, shear) by shooting: unknowns are force n and moment m at the proximal end,
    r' = R (e1 + C^-1 R' n),  R' = R [k0 + K^-1 R' m]x,  n' = 0,  m' = -r' x n,
loads are jumps of n and m, and both must vanish beyond the tip. Units mm, N, MPa. Independent of the program: another formulation, other code.
"""
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root
from scipy.spatial.transform import Rotation


def section(length, d, e, nu=0.3, bore=0.0, curvature=0.0, plane=0.0):
    i, a = np.pi / 64 * (d**4 - bore**4), np.pi / 4 * (d**2 - bore**2)
    g = e / (2 * (1 + nu))
    q, m2 = (1 + (bore / d) ** 2) ** 2, (bore / d) ** 2
    kappa = 6 * (1 + nu) * q / ((7 + 6 * nu) * q + (20 + 12 * nu) * m2)          # Cowper 1966
    k0 = curvature * np.array([0, -np.sin(plane), np.cos(plane)])
    return dict(length=length, stiff=np.array([g * 2 * i, e * i, e * i]), shear=np.array([e * a, kappa * g * a, kappa * g * a]), k0=k0)


def frame(direction, normal):
    e1 = np.array(direction, float) / np.linalg.norm(direction)
    e2 = np.array(normal, float) - np.dot(normal, e1) * e1
    e2 /= np.linalg.norm(e2)
    return np.column_stack([e1, e2, np.cross(e1, e2)])


def integrate(sections, start, base, loads, factor, unknown, places=()):
    """State at the tip after all loads, and at `places`."""
    y = np.concatenate([start, base.flatten(), unknown])
    at, found, borders = 0.0, {}, np.cumsum([s["length"] for s in sections])
    stops = sorted(set(list(borders) + [l["s"] for l in loads] + list(places)))
    for stop in stops:
        if stop > at + 1e-12:
            s = sections[int(np.searchsorted(borders, at + 1e-9, side="right"))]

            def rate(_, v):
                r = v[3:12].reshape(3, 3)
                n, m = v[12:15], v[15:18]
                k = s["k0"] + (r.T @ m) / s["stiff"]
                dr = r @ (np.array([1.0, 0, 0]) + (r.T @ n) / s["shear"])
                skew = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
                return np.concatenate([dr, (r @ skew).flatten(), np.zeros(3), -np.cross(dr, n)])

            y = solve_ivp(rate, (at, stop), y, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
            at = stop
        for l in loads:
            if abs(l["s"] - stop) < 1e-12:
                turn = y[3:12].reshape(3, 3) @ base.T if l.get("follower") else np.eye(3)
                y[12:15] -= factor * turn @ np.array(l.get("force", [0, 0, 0]), float)
                y[15:18] -= factor * turn @ np.array(l.get("moment", [0, 0, 0]), float)
        found[stop] = y[:12].copy()
    return y, found


def solve(sections, loads, direction=(1, 0, 0), normal=(0, 1, 0), start=(0, 0, 0), places=(), steps=8):
    base, start = frame(direction, normal), np.array(start, float)
    unknown = np.zeros(6)
    for i in range(1, steps + 1):
        s = root(lambda u: integrate(sections, start, base, loads, i / steps, u)[0][12:18], unknown * (i / max(i - 1, 1)), tol=1e-13)
        unknown = s.x
    tip, found = integrate(sections, start, base, loads, 1, unknown, places)
    assert np.abs(tip[12:18]).max() < 1e-8, (tip[12:18], s.message)
    return found, unknown


def show(name, found, unknown):
    print(name)
    for s, v in found.items():
        t = v[3:12].reshape(3, 3)[:, 0]
        print(f"  s {s:<8g} position ({v[0]:.9g}, {v[1]:.9g}, {v[2]:.9g})  tangent ({t[0]:.9g}, {t[1]:.9g}, {t[2]:.9g})")
    print(f"  force ({unknown[0]:.9g}, {unknown[1]:.9g}, {unknown[2]:.9g}) and moment ({unknown[3]:.9g}, {unknown[4]:.9g}, {unknown[5]:.9g}) of what lies beyond the clamp on it")


def main():
    standard = lambda length: section(length, 0.36, 80e3)
    # space-load.yaml: unequal loads in three directions at two places, with a moment that twists
    show("space-load", *solve([standard(60)], [dict(s=60, force=(0.01, 0.03, -0.05)), dict(s=40, force=(0, 0.06, 0.02), moment=(0.9, 0, 0.3))], places=(30,)))
    # space-load-turned.yaml: another wire, curved at rest, another direction and start, one load a follower
    show("space-load-turned",
         *solve([section(25, 0.5, 20e3, 0.4, bore=0.2), section(15, 0.4, 5e3, 0.4, curvature=0.04, plane=np.radians(60))],
                [dict(s=40, force=(0.02, -0.015, 0.01), follower=True), dict(s=20, force=(-0.04, 0.03, 0.05), moment=(0, 0.4, -0.5))],
                direction=(1, 2, -2), normal=(2, 1, 2), start=(5, -3, 7), places=(20,)))
    # follower.yaml
    show("follower", *solve([standard(50)], [dict(s=50, force=(0, 0, 0.08), follower=True)]))
    # sections.yaml: stiff to soft
    show("sections", *solve([section(40, 0.5, 80e3), section(30, 0.36, 20e3), section(10, 0.25, 1e3)], [dict(s=80, force=(0.001, 0.002, 0.004))], places=(40, 70)))


main()
