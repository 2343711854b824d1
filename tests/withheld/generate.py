#!/usr/bin/env python3
"""Writes cases of a withheld suite: OUT/CASE/{fit,check}.mcap (several: fit-1, check-1, ...), and the labels, encrypted, in OUT-labels/."""
import argparse
import hashlib
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(threads, "1")  # --jobs says how many cores are used

import numpy as np
from cryptography.fernet import Fernet

import effects as library
import model
import motions
import outside
import recording

SUITES = ("single", "pair", "triple", "none", "placement", "outside", "real-like", "long", "several")
DEFAULT_COUNT = {"pair": 60, "triple": 30, "none": 40, "placement": 40, "real-like": 40, "long": 20, "several": 30}
FIT_SECONDS, CHECK_SECONDS = {"long": 600.0, "several": 40.0}, 30.0  # a fit of 60 s where none is said
USUAL_SECONDS = library.USUAL_SECONDS
CLOCK_PPM = 25.0  # a reference's own clock, over the usual length: what the samples of the contract have


def plan(suite, count):
    """One entry per case: the effects with their levels, fixed or (None) to be drawn by the case."""
    if suite == "single":
        out = [[(effect, level)] for level in (1, 2, 0) for effect in library.ALL if level == 1 or effect not in library.CONVENTIONS]
    elif suite == "outside":
        out = [[(effect, level)] for level in (2, 1) for effect in outside.ALL]
    else:
        out = [None] * DEFAULT_COUNT[suite]
    count = count or len(out)
    return [out[index % len(out)] for index in range(count)]


def _several(rng, number, barred=()):
    while True:
        names = [str(name) for name in rng.choice([name for name in library.ALL if name not in barred], number, replace=False)]
        # one convention at most: two of them are rare in life
        if library.compatible(names) and sum(name in library.CONVENTIONS for name in names) <= 1:
            return [(name, int(rng.integers(1, 3))) for name in names]


def choose(rng, suite, planned, undeclared):
    barred = ("accel_noise", "gyro_noise") if undeclared else ()
    if planned is not None:
        return planned
    if suite == "none":
        return []
    if suite == "several" and rng.random() < 0.15:
        return []
    if suite in ("several", "long"):  # of several, one effect at most is the session's
        while True:
            chosen = _several(rng, int(rng.integers(1, 3)), barred)
            own = sum(name in library.SESSION for name, _ in chosen)
            if suite == "long" or (own < 2 and own < len(chosen) and "mount_slip" not in dict(chosen)):
                return chosen
    if suite == "placement":
        names = [name for name in library.ALL if name not in barred]
        return [(str(rng.choice(names)), int(rng.integers(0, 3)))]
    return _several(rng, 3 if suite == "triple" else 2, barred)


def _rate(rng):
    return float(rng.choice([50.0, 200.0, 204.8])) if rng.random() < 0.2 else 100.0 * rng.uniform(0.995, 1.005)


def _reference_rate(rng):
    return float(rng.choice([100.0, 120.0, 200.0])) if rng.random() < 0.7 else float(round(rng.uniform(60, 300), 1))


def _reference_times(rng, first, seconds, rate, gaps):
    times = first + np.arange(int(seconds * rate) + 1) / rate
    keep = np.ones(len(times), bool)
    for _ in range(int(rng.integers(1, 5)) if gaps else 0):
        length = rng.uniform(0.1, 1.0)
        begin = first + rng.uniform(1.5, seconds - 2.5)
        keep &= (times < begin) | (times > begin + length)
    return times, keep


def _clean(motion, stamps, t0, chosen):
    """The reading without noise, units undone: what the size of an effect is taken from."""
    force, rate = model.inner_stages(motion, model.true_times(stamps, t0, chosen), t0, chosen)
    limits = [chosen.get(f"{channel}_saturation", {}).get("limit", np.inf) for channel in ("accel", "gyro")]
    return [np.clip(value, -limit, limit) for value, limit in zip((force, rate), limits)]


def sizes(motion, stamps, t0, chosen):
    """Per effect: rms change of the reading (accel, gyro) when it alone is left out; a study's measure of strength."""
    with_all, out = _clean(motion, stamps, t0, chosen), {}
    for effect in chosen:
        without = _clean(motion, stamps, t0, {name: value for name, value in chosen.items() if name != effect})
        out[effect] = [float(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1)))) for a, b in zip(with_all, without)]
    return out


class Placement:
    """One device on one segment, through the recordings of one session or more."""

    def __init__(self, rng, chosen, undeclared, gaps, outside_effect, seconds):
        self.rng, self.chosen, self.gaps, self.seconds = rng, chosen, gaps, seconds
        self.rate, self.kind = _rate(rng), motions.draw_kind(rng)
        factors = np.exp(rng.uniform(np.log(0.5), np.log(4.0), 2)) if rng.random() < 0.6 else np.ones(2)
        self.sigmas = (0.014 * factors[0], 0.0012 * factors[1])
        self.declared = not undeclared
        self.ordinary = (rng.uniform(0.05e-3, 0.3e-3), np.radians(rng.uniform(0.02, 0.1)))
        self.filtering = {"noise_first": bool(rng.random() < 0.5), "kernel": str(rng.choice(["butterworth", "gaussian"], p=[0.7, 0.3]))}
        # in most cases the reference's own stamps run off by a few ppm: ordinary, and no cause; over any length by no more than over the usual
        self.reference_ppm = rng.uniform(-CLOCK_PPM, CLOCK_PPM) * min(1.0, USUAL_SECONDS / seconds) if rng.random() < 0.7 else 0.0
        self.device, self.outside_effect, self.sizes, self.facts = None, outside_effect, {}, {}

    def begin_session(self, base):
        """Draws what is the session's own; at the first, what is the device's too."""
        rng, self.base = self.rng, base
        self.reference_rate = _reference_rate(rng)
        self.reference_start = rng.uniform(0.0, 0.2)
        # t0 is the stamp of the first message, rounded as the message rounds it
        self.t0 = round(self.reference_start + rng.uniform(0.3, 1.0), 9)
        context = {"sigmas": self.sigmas, "rate": self.rate, "reference_rate": self.reference_rate, "start": self.t0, "seconds": self.seconds}
        drawn = {name: library.draw(rng, name, level, context) for name, level in self.chosen}
        if self.device is None:
            self.device = {name: value for name, value in drawn.items() if name not in library.SESSION}
        self.effects = {name: self.device.get(name, value) for name, value in drawn.items()}
        self.outside = outside.draw(rng, *self.outside_effect, context) if self.outside_effect else None

    def new_reference_rate(self):
        """Another rate, but above that of frames that were interpolated."""
        least = 1.6 * self.effects.get("reference_interpolation", {}).get("rate_hz", 0.0)
        self.reference_rate = max(_reference_rate(self.rng), least)

    def record(self, first, seconds, margin):
        """One recording whose reference starts at `first`; IMU stamps stay on the device's own grid."""
        rng, t0 = self.rng, self.t0
        motion = motions.make(rng, self.kind, first, first + seconds)
        interval = 1 / self.rate
        begin = int(np.ceil((first + margin - t0) * self.rate - 1e-6))
        end = int((first + seconds - rng.uniform(0.02, 0.1) - t0) * self.rate)
        stamps = t0 + np.arange(begin, end + 1) * interval
        extra = self.outside["hooks"] if self.outside else {}
        for effect in ("accel_saturation", "gyro_saturation"):
            if "clipped" in self.effects.get(effect, {}):
                self._set_limit(motion, stamps, effect)
                self.device[effect] = self.effects[effect]
        times = model.true_times(stamps, t0, self.effects)
        force, rate = model.inner_stages(motion, times, t0, self.effects, extra)
        if "jump" in extra:  # the offset changes in mid-recording: two readings spliced
            after = stamps - t0 >= extra["jump"][0]
            later = model.inner_stages(motion, times - extra["jump"][1], t0, self.effects)
            force, rate = (np.where(after[:, None], b, a) for a, b in zip((force, rate), later))
        if not self.sizes:
            self.sizes = sizes(motion, stamps, t0, self.effects)
            self.facts = {"accel_rms": float(np.sqrt(np.mean(np.sum((force - force.mean(0)) ** 2, 1)))), "gyro_rms": float(np.sqrt(np.mean(np.sum(rate**2, 1))))}
        accel, gyro = model.outer_stages(rng, force, rate, interval, self.sigmas, self.effects, extra, times - t0)
        if "stamps" in extra:
            stamps = extra["stamps"](stamps - t0) + t0
        keep = model.kept_samples(rng, len(stamps), self.effects)
        reference_times, reference_keep = _reference_times(rng, first, seconds, self.reference_rate, self.gaps)
        self.filtering["frame_phase"] = float(rng.choice([0.0, rng.random()]))
        position, rotation = model.reference(rng, motion, reference_times, self.effects, self.ordinary, self.filtering)
        quaternion = motions.continuous(rotation.as_quat())
        variances = (self.sigmas[1] ** 2, self.sigmas[0] ** 2) if self.declared else (0.0, 0.0)
        reference_stamps = first + (reference_times - first) * (1 - self.reference_ppm * 1e-6)
        return {"reference": (self._nanoseconds(reference_stamps)[reference_keep], position[reference_keep], quaternion[reference_keep]),
                "imu": (self._nanoseconds(stamps)[keep], gyro[keep], accel[keep]), "variances": variances}

    def _set_limit(self, motion, stamps, effect):
        index = 0 if effect.startswith("accel") else 1
        others = {name: value for name, value in self.effects.items() if name != effect and not name.endswith("_saturation")}
        largest = np.abs(_clean(motion, stamps, self.t0, others)[index]).max(axis=1)
        clipped = self.effects[effect]["clipped"]
        self.effects[effect] = {"limit": float(np.quantile(largest, 1 - clipped))}

    def _nanoseconds(self, times):
        return self.base * 1_000_000_000 + np.round(times * 1e9).astype(np.int64)

    def label(self):
        absolute = {name: dict(value) for name, value in self.effects.items()}
        if "mount_slip" in absolute:
            absolute["mount_slip"]["at"] += self.base
        return {"effects": absolute, "sizes": self.sizes, "epoch_ns": int(self._nanoseconds(np.array([self.t0]))[0]), "imu_rate": self.rate,
                "sigmas": self.sigmas, "declared": self.declared, "ordinary": self.ordinary, "reference_ppm": self.reference_ppm, "filtering": dict(self.filtering),
                "motion": self.kind, "facts": self.facts, "outside": self.outside["label"] if self.outside else None}


def case_name(suite, seed, index, seconds):
    return hashlib.sha256(f"withheld {suite} {seed} {index} {seconds}".encode()).hexdigest()[:10]


def usual_seconds(suite):
    return FIT_SECONDS.get(suite, USUAL_SECONDS)


def recordings(folder, kind):
    """The paths of a case's recordings: kind fit or check, in the order of their sessions."""
    return [os.path.join(folder, name) for name in sorted(os.listdir(folder)) if name.startswith(kind) and name.endswith(".mcap")]


def devices_of(job, names, affected, chosen, undeclared, gaps):
    _, suite, seed, index, _, seconds = job
    out = {}
    for number, place in enumerate(names):
        # every placement has a generator of its own: its draws do not depend on the others
        own = np.random.default_rng([seed, SUITES.index(suite), index, int(seconds), number + 1])
        hidden = chosen if place == affected else []
        out[place] = Placement(own, [] if suite == "outside" else hidden, undeclared, gaps, hidden[0] if hidden and suite == "outside" else None, seconds)
    return out


def write_session(rng, folder, suffix, devices, base, seconds):
    """One fit recording and, some time later in the same session, its check; returns the labels of the placements."""
    for device in devices.values():
        device.begin_session(base)
    check_start = seconds + rng.uniform(0.3, 60.0)
    for file, first, length in (("fit", None, seconds), ("check", check_start, CHECK_SECONDS)):
        placements = {}
        for place, device in devices.items():
            start = device.reference_start if first is None else first + device.reference_start
            margin = device.t0 - device.reference_start if first is None else rng.uniform(0.05, 0.5)
            placements[place] = device.record(start, length, margin)
            if rng.random() < 0.5:
                device.new_reference_rate()
        recording.write(os.path.join(folder, f"{file}{suffix}.mcap"), placements)
    return {place: device.label() for place, device in devices.items()}


def build(job):
    """Writes one case's recordings and returns its label."""
    folder, suite, seed, index, planned, seconds = job
    name = case_name(suite, seed, index, seconds)
    rng = np.random.default_rng([seed, SUITES.index(suite), index, int(seconds)])
    noisy_effect = planned and planned[0][0] in ("accel_noise", "gyro_noise", "accel_quantization", "gyro_quantization")
    undeclared = not noisy_effect and rng.random() < (1.0 if suite == "real-like" else 0.06)
    gaps = suite == "real-like" or rng.random() < 0.2
    chosen = choose(rng, suite, planned, undeclared)
    number = {"placement": 3, "long": 5}.get(suite) or int(rng.choice([1, 2, 3], p=[0.8, 0.12, 0.08]))
    names = [str(x) for x in rng.permutation(["wrist", "ankle", "pelvis", "left_forearm", "right_foot"])[:number]]
    affected = str(rng.choice(names)) if chosen else None
    devices = devices_of(job, names, affected, chosen, undeclared, gaps)
    os.makedirs(os.path.join(folder, name), exist_ok=True)
    base, sessions = 1_700_000_000 + int(rng.integers(0, 20_000_000)), []
    for session in range(int(rng.integers(2, 4)) if suite == "several" else 1):
        suffix = f"-{session + 1}" if suite == "several" else ""
        sessions.append(write_session(rng, os.path.join(folder, name), suffix, devices, base, seconds))
        base += int(rng.integers(3_000, 300_000))  # hours to days later
    return {"case": name, "suite": suite, "seconds": seconds, "affected": affected, "strength": {effect: library.STRENGTHS[level] for effect, level in chosen},
            "gaps": gaps, "undeclared": undeclared, "sessions": sessions}


def labels_folder(out):
    return out.rstrip("/") + "-labels"


def key_of(labels):
    path = os.path.join(labels, "key")
    if not os.path.exists(path):
        with open(path, "wb") as stream:
            stream.write(Fernet.generate_key())
    with open(path, "rb") as stream:
        return Fernet(stream.read())


def read_label(labels, case):
    with open(os.path.join(labels, f"{case}.json.enc"), "rb") as stream:
        return json.loads(key_of(labels).decrypt(stream.read()))


def write_label(labels, label):
    with open(os.path.join(labels, f"{label['case']}.json.enc"), "wb") as stream:
        stream.write(key_of(labels).encrypt(json.dumps(label).encode()))
    return label["case"]


def generate(out, suite, seed=1, count=None, only=None, jobs=1, seconds=None):
    if seconds and suite == "outside":
        sys.exit("--seconds: the effects of the outside suite are made for its own length")
    if motions.data_folder() is None:
        print("motion data absent (CROMOSIM_DATA): synthetic motions only", file=sys.stderr)
    seconds = seconds or usual_seconds(suite)
    work = [(out, suite, seed, index, planned, seconds) for index, planned in enumerate(plan(suite, count))]
    work = [job for job in work if only is None or case_name(suite, seed, job[3], seconds) == only]
    return write_all(out, build, work, jobs)


def write_all(out, build, work, jobs):
    """Builds the cases of some work in so many processes; their names. `build` writes a case and returns its label, none where there is no case."""
    labels = labels_folder(out)
    os.makedirs(out, exist_ok=True)
    os.makedirs(labels, exist_ok=True)
    with ProcessPoolExecutor(jobs) as pool:
        return [write_label(labels, label) for label in pool.map(build, work) if label is not None]


def command_line(doc, suites, generate):
    """What the other generators do on their own."""
    parser = argparse.ArgumentParser(description=doc)
    parser.add_argument("out", help="folder of the cases; their labels come into OUT-labels")
    parser.add_argument("--suite", choices=list(suites), required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    for case in generate(options.out, options.suite, options.seed, options.count, options.jobs):
        print(case)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out")
    parser.add_argument("--suite", choices=SUITES, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int)
    parser.add_argument("--seconds", type=float, help="length of the fit recordings; default the suite's own")
    parser.add_argument("--only", metavar="CASE")
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    for case in generate(options.out, options.suite, options.seed, options.count, options.only, options.jobs, options.seconds):
        print(case)
