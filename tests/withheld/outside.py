"""Effects that the contract's table does not hold; the right answer to each is `unknown`.

`draw` returns a label and hooks. A hook takes the time since t0 [s] and both channels; the names tell where it acts:
`mount` (continuous, behind the mount), `channel` (behind the low-pass), `noise` (behind the white noise), `stamps`, `jump`."""
import numpy as np
from scipy.spatial.transform import Rotation

ALL = ("deadband", "accel_cubic", "gyro_cubic", "rate_squared_in_accel", "rate_in_accel", "curved_bias", "bias_step", "frozen_samples",
       "spikes", "stamp_jitter", "orientation_bias", "mount_backlash", "channels_turned", "slow_gain", "offset_jump", "interference",
       "bias_walk")


def _unit(rng):
    value = rng.standard_normal(3)
    return value / np.linalg.norm(value)


def _on(channel, change):
    """A hook that changes one channel."""
    return lambda t, force, rate: (change(t, force), rate) if channel == "accel" else (force, change(t, rate))


def _deadband(rng, level, context, channel):
    width = {"accel": (0.4, 1.2), "gyro": (0.06, 0.25)}[channel][level]
    return {"width": width}, {"channel": _on(channel, lambda t, x: np.where(np.abs(x) < width, 0.0, x))}


def _cubic(rng, level, context, channel):
    full = {"accel": 20.0, "gyro": 6.0}[channel]  # where the deviation reaches the stated share
    share = (0.05, 0.2)[level] * rng.choice([-1, 1])
    return {"share": share, "at": full}, {"channel": _on(channel, lambda t, x: x * (1 + share * np.minimum((x / full) ** 2, 2.0)))}


def _rate_squared(rng, level, context, channel):
    gain = (0.03, 0.12)[level] * _unit(rng)
    return {"gain": gain.tolist()}, {"mount": lambda t, f, w: (f + np.sum(w**2, axis=1)[:, None] * gain, w)}


def _rate_in_accel(rng, level, context, channel):
    matrix = (0.06, 0.25)[level] * np.tril(rng.uniform(0.4, 1, (3, 3)) * rng.choice([-1, 1], (3, 3)))
    return {"matrix": matrix.tolist()}, {"mount": lambda t, f, w: (f + w @ matrix.T, w)}


def _curved_bias(rng, level, context, channel):
    bias = {"accel": (0.25, 1.0), "gyro": (0.03, 0.12)}[channel][level] * _unit(rng)
    constant = rng.uniform(5, 15)
    return {"bias": bias.tolist(), "time_constant": constant}, {"channel": _on(channel, lambda t, x: x + np.exp(-np.maximum(t, 0) / constant)[:, None] * bias)}


def _bias_step(rng, level, context, channel):
    bias = {"accel": (0.3, 1.0), "gyro": (0.03, 0.12)}[channel][level] * _unit(rng)
    at = rng.uniform(0.3, 0.7) * context["seconds"]
    return {"bias": bias.tolist(), "at": at}, {"channel": _on(channel, lambda t, x: x + (t >= at)[:, None] * bias)}


def _frozen(rng, level, context, channel):
    share, burst = (0.06, 0.25)[level], rng.uniform(5, 20)
    own = np.random.default_rng(rng.integers(2**62))

    def hook(t, force, rate):
        index, held = np.arange(len(t)), False
        for k, draw in enumerate(own.random(len(t))):
            held = k > 0 and (draw >= 1 / burst if held else draw < share / (1 - share) / burst)
            if held:
                index[k] = index[k - 1]
        return force[index], rate[index]
    return {"share": share, "mean_burst": burst}, {"noise": hook}


def _spikes(rng, level, context, channel):
    share, size = (0.004, 0.02)[level], {"accel": 25.0, "gyro": 5.0}[channel]
    own = np.random.default_rng(rng.integers(2**62))
    return {"share": share, "size": size}, {"noise": _on(channel, lambda t, x: x + size * (own.random(x.shape) < share) * own.standard_normal(x.shape))}


def _jitter(rng, level, context, channel):
    sigma = (0.15, 0.4)[level] / context["rate"]
    own = np.random.default_rng(rng.integers(2**62))

    def hook(stamps):
        late = np.clip(sigma * own.standard_normal(len(stamps)), -0.45 / context["rate"], 0.45 / context["rate"])
        late[0] = 0.0  # t0 is the first stamp
        return stamps + late
    return {"sigma": sigma}, {"stamps": hook}


def _orientation_bias(rng, level, context, channel):
    gain = {"accel": (0.3, 1.0), "gyro": (0.04, 0.15)}[channel][level] * rng.choice([-1, 1], 3)

    def hook(t, force, rate):
        up = force / np.maximum(np.linalg.norm(force, axis=1, keepdims=True), 1.0)
        bias = gain * up * up[:, [1, 2, 0]]  # even in the direction: neither scale nor cross terms make it
        return (force + bias, rate) if channel == "accel" else (force, rate + bias)
    return {"gain": gain.tolist()}, {"channel": hook}


def _backlash(rng, level, context, channel):
    play, axis = np.radians((3.0, 9.0)[level]), _unit(rng)

    def hook(t, force, rate):
        step, turn = t[1] - t[0], np.zeros(len(t))
        drive = rate @ axis * step
        for k in range(1, len(t)):  # the play operator: the sensor stays behind until the play is used up
            turn[k] = min(play, max(-play, turn[k - 1] - drive[k]))
        # the play's ends are soft over some 20 ms, else the gyro would jump
        width = int(0.02 / step) | 1
        kernel = np.hanning(width + 2)[1:-1]
        turn = np.convolve(np.pad(turn, width // 2, mode="edge"), kernel / kernel.sum(), mode="valid")
        mount = Rotation.from_rotvec(turn[:, None] * axis)
        return mount.apply(force, inverse=True), mount.apply(rate, inverse=True) + np.gradient(turn, step)[:, None] * axis
    return {"play": play, "axis": axis.tolist()}, {"mount": hook}


def _turned(rng, level, context, channel):
    turn = Rotation.from_rotvec(np.radians((3.0, 12.0)[level]) * _unit(rng))
    return {"rotvec": turn.as_rotvec().tolist()}, {"channel": lambda t, f, w: (f, turn.apply(w, inverse=True))}


def _slow_gain(rng, level, context, channel):
    depth, period, phase = (0.04, 0.15)[level], rng.uniform(15, 40), rng.uniform(0, 2 * np.pi)
    return {"depth": depth, "period": period}, {"channel": _on(channel, lambda t, x: x * (1 + depth * np.sin(2 * np.pi * t / period + phase))[:, None])}


def _jump(rng, level, context, channel):
    at, seconds = rng.uniform(0.3, 0.7) * context["seconds"], (0.02, 0.08)[level] * rng.choice([-1, 1])
    return {"at": at, "seconds": seconds}, {"jump": (at, seconds)}


def _interference(rng, level, context, channel):
    sigma = (10, 40)[level] * context["sigmas"][0 if channel == "accel" else 1]
    period, length, phase = rng.uniform(35, 45), rng.uniform(5, 9), rng.uniform(5, 25)
    own = np.random.default_rng(rng.integers(2**62))
    return ({"sigma": sigma, "first": phase, "every": period, "length": length},
            {"noise": _on(channel, lambda t, x: x + (((t - phase) % period < length) * sigma)[:, None] * own.standard_normal(x.shape))})


def _walk(rng, level, context, channel):
    density = {"accel": (0.05, 0.2), "gyro": (0.005, 0.02)}[channel][level]  # per s per sqrt(Hz)
    grid = np.arange(-5.0, 200.0, 0.02)
    steps = density * np.sqrt(0.02) * np.random.default_rng(rng.integers(2**62)).standard_normal((len(grid), 3))
    walk = np.cumsum(steps, axis=0)
    walk -= walk[np.searchsorted(grid, 0.0)]
    hook = _on(channel, lambda t, x: x + np.stack([np.interp(t, grid, walk[:, axis]) for axis in range(3)], axis=1))
    return {"density": density}, {"channel": hook}


_MAKERS = {"deadband": _deadband, "accel_cubic": _cubic, "gyro_cubic": _cubic, "rate_squared_in_accel": _rate_squared, "rate_in_accel": _rate_in_accel,
           "curved_bias": _curved_bias, "bias_step": _bias_step, "frozen_samples": _frozen, "spikes": _spikes, "stamp_jitter": _jitter,
           "orientation_bias": _orientation_bias, "mount_backlash": _backlash, "channels_turned": _turned, "slow_gain": _slow_gain,
           "offset_jump": _jump, "interference": _interference, "bias_walk": _walk}
_CHANNEL = {"accel_cubic": "accel", "gyro_cubic": "gyro", "rate_squared_in_accel": "accel", "rate_in_accel": "accel"}
_BOTH = ("frozen_samples", "stamp_jitter", "mount_backlash", "channels_turned", "offset_jump")


def draw(rng, effect, level, context):
    """level 1 is medium, 2 is strong."""
    channel = _CHANNEL.get(effect) or str(rng.choice(["accel", "gyro"]))
    parameters, hooks = _MAKERS[effect](rng, level - 1, context, channel)
    parameters = {name: float(value) if np.isscalar(value) else value for name, value in parameters.items()}
    return {"label": {"name": effect, "channel": "both" if effect in _BOTH else channel, **parameters}, "hooks": hooks}
