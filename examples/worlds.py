"""Sensors and plants of the examples, with the truth beside them.

A world is named after its filter, and takes the place of a log::

    boresight check radar.py worlds.py:Radar
    boresight run radar.py worlds.py:Radar --levels float -o radar.csv
    boresight montecarlo worlds.py:Radar radar.py

``Uwb(n=2000)`` gives 2,000 samples; ``seed`` draws other noise.
"""

import numpy as np

from boresight import World


class Sensors(World):
    """Sensors that do not depend on outputs; a subclass has ``columns``."""

    def __init__(self, n=400, seed=1):
        self.n, self.seed = n, seed

    def draw(self, seed):
        self.seed = seed

    def pieces(self):
        self.noise = np.random.default_rng(self.seed).normal
        yield self.columns(np.arange(self.n))

    def noisy(self, values, sd):
        """Values with noise of standard deviation ``sd``."""
        return values + self.noise(0.0, sd, self.n)


def every(k, step, values):
    """Values in each ``step``-th sample, NaN between them."""
    return np.where(k % step == 0, values, np.nan)


class Matrices(Sensors):
    """A vehicle at 12 m/s that turns slowly; positions with 2 m of noise."""

    def columns(self, k):
        t, (vx, vy) = 0.1 * k, self.noise(0.0, 0.03, (2, self.n)).cumsum(axis=1)
        vx, vy = 12.0 * np.cos(0.05 * t) + vx, 12.0 * np.sin(0.05 * t) + vy
        px, py = 0.1 * np.cumsum(vx), 0.1 * np.cumsum(vy)
        true = {"px_true": px, "py_true": py, "vx_true": vx, "vy_true": vy}
        return {"zx": self.noisy(px, 2.0), "zy": self.noisy(py, 2.0), **true}


class Radar(Sensors):
    """An aircraft that passes at 2 km; 10 m and 5 mrad of noise."""

    def columns(self, k):
        t = 0.5 * (k - 0.5 * self.n)
        px, py = 25.0 * t, 2000.0 + 5.0 * t
        r, b = np.hypot(px, py), np.arctan2(py, px)
        return {"r": self.noisy(r, 10.0), "b": self.noisy(b, 5e-3), "px_true": px, "py_true": py}


class Bearing(Sensors):
    """A ship at 3 km, seen from an observer that swings across the line of sight."""

    def columns(self, k):
        t = 0.5 * k
        px, py, oy = 2900.0 - 4.0 * t, 800.0 - 5.0 * t, 700.0 * np.sin(0.05 * t)
        z = self.noisy(np.arctan2(py - oy, px), 2e-3)
        return {"z": z, "oy": oy, "px_true": px, "py_true": py}


class Falling(Sensors):
    """A body that enters the air at 6 km/s; its distance with 30 m of noise."""

    def __init__(self, n=180, seed=1):
        super().__init__(n, seed)

    def columns(self, k):
        """Every 0.1 s, computed in steps of 5 ms."""
        h, v, c, states = 90.0, -6.0, 0.4, []
        for _ in k:
            states.append((h, v))
            for _ in range(20):
                v += 5e-3 * (c * np.exp(-h / 6.1) * v * v - 9.81e-3)
                h += 5e-3 * v
        h, v = np.array(states).T
        z = self.noisy(np.hypot(30.0, h - 30.0), 0.03)
        return {"z": z, "h_true": h, "v_true": v, "c_true": np.full(self.n, c)}


class Pendulum(Sensors):
    """A pendulum that swings by half a radian; its bob with 2 cm of noise."""

    def columns(self, k):
        angle, rate, states = 0.6, 0.0, []
        for _ in k:
            rate += 0.01 * (-9.81 * np.sin(angle) - 0.1 * rate)
            angle += 0.01 * rate
            states.append((angle, rate))
        angle, rate = np.array(states).T
        return {"z": self.noisy(np.sin(angle), 0.02), "angle_true": angle, "rate_true": rate}


class SigmaPoints(Pendulum):
    """The same pendulum."""


class Altitude(Sensors):
    """A drone at 100 Hz; a barometer that is 0.12 s late, a lidar with outliers."""

    def columns(self, k):
        t = 0.01 * k
        h, v = 12.0 + 8.0 * np.sin(0.5 * t), 4.0 * np.cos(0.5 * t)
        late = 12.0 + 8.0 * np.sin(0.5 * (t - 0.12))
        lidar = np.where(k % 40 == 20, 3.0, self.noisy(h, 0.03))
        return {
            "acc": self.noisy(-2.0 * np.sin(0.5 * t) + 0.3, 0.15),
            "baro": every(k, 4, self.noisy(late, 0.25)),
            "lidar": every(k, 10, lidar),
            **{"h_true": h, "v_true": v, "b_true": np.full(self.n, 0.3)},
        }


class Robot(Sensors):
    """A robot on a circle; in each sample it sees one of three landmarks."""

    def columns(self, k):
        speed, turn = 0.8 + 0.0 * k, 0.25 + 0.0 * k
        heading = 0.3 + 0.025 * k
        px = 5.0 + np.cumsum(0.08 * np.cos(heading)) - 0.08 * np.cos(heading)
        py = 2.0 + np.cumsum(0.08 * np.sin(heading)) - 0.08 * np.sin(heading)
        lx, ly = np.array([[-2.0, 5.0, 12.0], [12.0, 14.0, 12.5]])[:, k % 3]
        distance, angle = np.hypot(lx - px, ly - py), np.arctan2(ly - py, lx - px) - heading
        bearing = (self.noisy(angle, 0.02) / np.pi + 1.0) % 2.0 - 1.0
        return {
            **{"speed": self.noisy(speed, 0.05), "turn": self.noisy(turn, 0.02)},
            **{"lx": lx, "ly": ly, "distance": self.noisy(distance, 0.05), "bearing": bearing},
            **{"px_true": px, "py_true": py, "heading_true": (heading / np.pi + 1) % 2 - 1},
        }


class Uwb(Sensors):
    """A tag that is carried through a hall of 20 m by 12 m; distances with 10 cm of noise."""

    def columns(self, k):
        px, py = 10.0 + 7.0 * np.cos(0.02 * k), 6.0 + 4.0 * np.sin(0.03 * k)
        corners = ((0.0, 0.0), (20.0, 0.0), (20.0, 12.0), (0.0, 12.0))
        distances = [np.sqrt((px - x) ** 2 + (py - y) ** 2 + 4.0) for x, y in corners]
        z = {f"d{n}": self.noisy(d, 0.1) for n, d in enumerate(distances)}
        return {**z, "px_true": px, "py_true": py}


class GpsImu(Sensors):
    """A car on a large eight at 50 Hz; fixes with 1.5 m of noise once a second."""

    def columns(self, k):
        """Speed and heading swing; the gyro is off by 0.02 rad/s."""
        t = 0.02 * k
        speed, acc = 10.0 + 2.0 * np.sin(0.3 * t), 0.6 * np.cos(0.3 * t)
        heading, rate = 1.5 * np.sin(0.2 * t), 0.3 * np.cos(0.2 * t)
        px, py = (np.cumsum(0.02 * speed * part(heading)) for part in (np.cos, np.sin))
        return {
            **{"acc": self.noisy(acc, 0.1), "rate": self.noisy(rate + 0.02, 0.005)},
            **{n: every(k, 50, self.noisy(p, 1.5)) for n, p in (("fx", px), ("fy", py))},
            **{"px_true": px, "py_true": py, "speed_true": speed, "heading_true": heading / np.pi},
        }


class Tilt(Sensors):
    """A hand that tilts a sensor about two axes; the gyro is off by up to 0.02 rad/s."""

    def columns(self, k):
        """At 100 Hz: roll about x, then pitch about y."""
        roll, pitch = 0.6 * np.sin(0.012 * k), 0.4 * np.sin(0.017 * k)
        droll, dpitch = 0.72 * np.cos(0.012 * k), 0.68 * np.cos(0.017 * k)
        gyro = (droll, dpitch * np.cos(roll), -dpitch * np.sin(roll))
        up = (-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll))
        bias = zip("xyz", gyro, (0.02, -0.01, 0.0), strict=True)
        return {
            **{f"g{a}": self.noisy(g + b, 0.01) for a, g, b in bias},
            **{f"a{a}": self.noisy(9.81 * c, 0.15) for a, c in zip("xyz", up, strict=True)},
            **{"roll_true": roll / np.pi, "pitch_true": pitch / np.pi},
        }


class Pmsm(Sensors):
    """A synchronous motor on a voltage that turns twice a second; currents with 0.1 A of noise."""

    def columns(self, k):
        ua, ub = 4.0 * np.sin(0.0025 * k), -4.0 * np.cos(0.0025 * k)
        ia = ib = speed = angle = 0.0
        states = []
        for a, b in zip(ua, ub, strict=True):
            s, c = np.sin(angle), np.cos(angle)
            ia, ib, speed, angle = (
                ia + 2e-4 / 3e-3 * (a - 2.0 * ia + 0.1 * speed * s),
                ib + 2e-4 / 3e-3 * (b - 2.0 * ib - 0.1 * speed * c),
                speed + 2e-4 / 2e-3 * (0.15 * (ib * c - ia * s) - 1e-3 * speed),
                angle + 2e-4 * speed,
            )
            states.append((ia, ib, speed, angle))
        ia, ib, speed, angle = np.array(states).T
        return {
            **{"ua": ua, "ub": ub, "ia_z": self.noisy(ia, 0.1), "ib_z": self.noisy(ib, 0.1)},
            **{"speed_true": speed, "angle_true": (angle / np.pi + 1.0) % 2.0 - 1.0},
        }


class Induction(Sensors):
    """An induction motor that starts on 50 Hz; currents with 0.2 A of noise."""

    def columns(self, k):
        """Every 0.1 ms, 2 kW, torque against inertia alone."""
        ua, ub = 300.0 * np.cos(0.01 * np.pi * k), 300.0 * np.sin(0.01 * np.pi * k)
        ia = ib = fa = fb = w = 0.0
        states = []
        for a, b in zip(ua, ub, strict=True):
            da, db = 20.0 * fa + w * fb, 20.0 * fb - w * fa
            ia, ib, fa, fb, w = (
                ia + 1e-4 * (-400.0 * ia + 60.0 * da + 64.0 * a),
                ib + 1e-4 * (-400.0 * ib + 60.0 * db + 64.0 * b),
                fa + 1e-4 * (3.2 * ia - 20.0 * fa - w * fb),
                fb + 1e-4 * (3.2 * ib - 20.0 * fb + w * fa),
                w + 1e-4 * 60.0 * (fa * ib - fb * ia),
            )
            states.append((ia, ib, fa, fb, w))
        ia, ib, fa, fb, w = np.array(states).T
        return {
            **{"ua": ua, "ub": ub, "ia_z": self.noisy(ia, 0.2), "ib_z": self.noisy(ib, 0.2)},
            **{"fa_true": fa, "fb_true": fb, "w_true": w},
        }


class Charge(Sensors):
    """A cell of 2.5 Ah under pulses of current; its voltage with 5 mV of noise."""

    def columns(self, k):
        i = np.where(k % 60 < 40, 4.0, -1.0) + np.sin(0.1 * k)
        soc = 0.8 - np.cumsum(i) / 9000.0
        v1 = np.zeros(self.n)
        for n in range(1, self.n):
            v1[n] = 0.96 * v1[n - 1] + 0.04 * 0.02 * i[n]
        open_circuit = 4.23 - 3.86e-5 / soc - 0.24 * soc + 0.22 * np.log(soc)
        v = open_circuit - 0.04 * np.log(1.0 - soc) - v1 - 0.03 * i
        true = {"soc_true": soc, "v1_true": v1}
        return {"i": self.noisy(i, 0.02), "v": self.noisy(v, 5e-3), **true}


class Tanks(Sensors):
    """Two tanks above each other; a pump fills the upper one, a gauge shows the lower one."""

    def columns(self, k):
        """Every second, computed in steps of a tenth."""
        pump = np.where(k // 100 % 2, 60.0, 90.0)
        h1, h2, states = 15.0, 10.0, []
        for q in pump:
            for _ in range(10):
                q1, q2 = 0.5 * np.sqrt(1962.0 * h1), 0.45 * np.sqrt(1962.0 * h2)
                h1, h2 = h1 + 0.1 / 28.0 * (q - q1), h2 + 0.1 / 32.0 * (q1 - q2)
            states.append((h1, h2))
        h1, h2 = np.array(states).T
        return {"pump": pump, "z": self.noisy(h2, 0.1), "h1_true": h1, "h2_true": h2}


class Thermal(Sensors):
    """A winding that heats its housing; only the housing is measured, with 0.2 K of noise."""

    def columns(self, k):
        power = np.where(k % 200 < 120, 80.0, 10.0)
        winding, housing, states = 20.0, 20.0, []
        for p in power:
            flow = 1.5 * (winding - housing)
            winding += (p - flow) / 60.0
            housing += (flow - 0.8 * (housing - 20.0)) / 200.0
            states.append((winding, housing))
        winding, housing = np.array(states).T
        z = self.noisy(housing, 0.2)
        return {"power": power, "z": z, "winding_true": winding, "housing_true": housing}


class Observer(Sensors):
    """A servo motor on a square voltage; its angle from an encoder of 1 mrad."""

    def columns(self, k):
        volts = np.where(k // 100 % 2, -6.0, 6.0)
        angle, speed, current, states = 0.0, 0.0, 0.0, []
        for u in volts:
            angle, speed, current = (
                angle + 1e-3 * speed,
                speed + 1e-3 * (5.0 * current - 2.0 * speed),
                current + 1e-3 * (100.0 * u - 50.0 * current - 5.0 * speed),
            )
            states.append((angle, speed, current))
        angle, speed, current = np.array(states).T
        true = {"angle_true": angle, "speed_true": speed, "current_true": current}
        return {"volts": volts, "z": np.round(angle, 3), **true}


class Pll(Sensors):
    """A carrier of 35 Hz that wanders by 10 Hz, at 1 kHz."""

    def columns(self, k):
        """Two quadratures with 5 % of noise."""
        frequency = 35.0 + 10.0 * np.sin(2e-3 * k)
        phase = np.cumsum(2e-3 * np.pi * frequency)
        ahead = phase / np.pi + 2e-3 * frequency  # of the next sample
        i, q = (self.noisy(part(phase), 0.05) for part in (np.cos, np.sin))
        true = {"phase_true": (ahead + 1.0) % 2.0 - 1.0, "frequency_true": frequency}
        return {"i": i, "q": q, **true}


class AlphaBetaGamma(Sensors):
    """A target that brakes and accelerates; ranges with 3 m of noise."""

    def columns(self, k):
        t = 0.05 * k
        r, v, a = 1000.0 + 300.0 * np.sin(0.2 * t), 60.0 * np.cos(0.2 * t), -12.0 * np.sin(0.2 * t)
        return {"z": self.noisy(r, 3.0), "r_true": r, "v_true": v, "a_true": a}


class Adaptive(Sensors):
    """A cart; the noise of its positions is five times as large in the second half."""

    def columns(self, k):
        t = 0.02 * k
        pos, vel = 20.0 * np.sin(0.5 * t), 10.0 * np.cos(0.5 * t)
        sd = np.where(k < self.n // 2, 0.2, 1.0)
        z = pos + sd * self.noise(0.0, 1.0, self.n)
        return {"z": z, "pos_true": pos, "vel_true": vel, "r_true": sd * sd}


class Loop(World):
    """A plant in a loop; a subclass has ``start`` and ``moved``."""

    def __init__(self, n=400):
        self.n = n

    def record(self, outputs):
        if self.k == self.n:
            return None
        sample = self.moved(0.0 if outputs is None else outputs["drive"])
        self.k += 1
        return sample


class Pid(Loop):
    """A servo axis with a resonance at 50 Hz, 1 kHz; its target jumps by 1 rad."""

    def start(self):
        self.k, self.angle, self.speed, self.bend, self.rate = 0, 0.0, 0.0, 0.0, 0.0

    def moved(self, drive):
        """One period in ten steps: a body, and a mode that rings with it."""
        for _ in range(10):
            self.speed += 1e-4 * (40.0 * drive - 4.0 * self.speed)
            self.angle += 1e-4 * self.speed
            self.rate += 1e-4 * (400.0 * drive - 98696.0 * self.bend - 12.0 * self.rate)
            self.bend += 1e-4 * self.rate
        return {"target": float(self.k // 300 % 2 == 0), "angle": self.angle + self.bend}


class Lqg(Loop):
    """An inverted pendulum on a cart, 100 Hz; position and angle with noise."""

    def start(self):
        self.k, self.x, self.noise = 0, np.array([0.0, 0.0, 0.05, 0.0]), np.random.default_rng(1)

    def moved(self, drive):
        _, speed, angle, rate = self.x
        acc = -0.2 * speed - 1.0 * angle + 1.0 * drive
        turn = 0.2 * speed + 20.0 * angle - 2.0 * drive
        self.x = self.x + 0.01 * np.array([speed, acc, rate, turn])
        z, phi = self.x[[0, 2]] + self.noise.normal(0.0, (2e-3, 1e-3))
        names = ("pos_true", "speed_true", "angle_true", "rate_true")
        return {"z": z, "phi": phi, **dict(zip(names, self.x, strict=True))}
