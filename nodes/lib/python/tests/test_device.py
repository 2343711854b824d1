"""A device's effects on the user's own readings."""

import numpy as np
import pytest

import cromosim
from cromosim import Device, Placement

RATE_HZ = 100
STAMPS = 1 + np.arange(2000) / RATE_HZ
STILL = np.tile([0.0, 0.0, 9.80665], (2000, 1))
ZERO = np.zeros((2000, 3))


def swing():
    """Ideal readings of a wrist that walks, with orientation."""
    walk, placement = cromosim.walk(), {"wrist": Placement(site="left_watch")}
    ideal = cromosim.simulate(walk, placement, rate_hz=RATE_HZ)["wrist"]
    real = cromosim.simulate(walk, placement, rate_hz=RATE_HZ, device="consumer_mems", seed=3)
    return ideal, real["wrist"]


def test_the_ideal_imu_with_a_device_is_the_device_simulated():
    ideal, real = swing()
    ours = cromosim.apply_device(
        "consumer_mems",
        ideal.stamps_s,
        ideal.specific_force,
        ideal.angular_velocity,
        orientation=ideal.orientation,
        rate_hz=RATE_HZ,
        seed=3,
        name="wrist",
    )
    assert np.abs(ours.specific_force - real.specific_force).max() < 1e-12
    assert np.abs(ours.angular_velocity - real.angular_velocity).max() < 1e-12
    assert np.abs(real.specific_force - ideal.specific_force).max() > 1e-2
    assert (ours.stamps_ns == real.stamps_ns).all()


def test_no_device_changes_nothing():
    ideal, _ = swing()
    same = cromosim.apply_device(
        None, ideal.stamps_s, ideal.specific_force, ideal.angular_velocity
    )
    assert np.abs(same.specific_force - ideal.specific_force).max() < 1e-13
    assert (same.angular_velocity == ideal.angular_velocity).all()
    assert same.orientation is None


def test_a_bias_is_added_and_noise_has_its_density():
    bias, density = np.array([0.1, -0.2, 0.3]), 0.01
    device = Device({"accel_bias": {"bias": bias}}, accel_density=density)
    read = cromosim.apply_device(device, STAMPS, STILL, ZERO, seed=5)
    errors = read.specific_force - STILL
    # One-sided density: sigma = density * sqrt(rate / 2) or its convention; the mean tells the bias.
    assert np.abs(errors.mean(axis=0) - bias).max() < 5 * density * RATE_HZ**0.5 / 2000**0.5
    quiet = cromosim.apply_device(device, STAMPS, STILL, ZERO, noise=False).specific_force
    assert np.abs(quiet - STILL - bias).max() < 1e-12
    declared = read.specific_force_covariance[0, 0] ** 0.5
    assert abs(errors.std(axis=0).mean() / declared - 1) < 0.05


def test_each_name_and_seed_draws_its_own_noise():
    device = Device(gyro_density=0.01)
    drawn = {
        (name, seed): cromosim.apply_device(device, STAMPS, STILL, ZERO, name=name, seed=seed)
        for name in ("a", "b")
        for seed in (0, 1)
    }
    assert len({read.angular_velocity.tobytes() for read in drawn.values()}) == 4


def test_a_simulation_takes_a_device_of_ones_own():
    device = Device({"gyro_bias": {"bias": [0.01, 0.02, 0.03]}})
    walk, sites = cromosim.walk(), {"wrist": Placement(site="left_watch")}
    with_bias = cromosim.simulate(walk, sites, device=device)["wrist"].angular_velocity
    without = cromosim.simulate(walk, sites)["wrist"].angular_velocity
    assert np.allclose(with_bias - without, [0.01, 0.02, 0.03], atol=1e-12)


def test_every_effect_is_described():
    known = {effect["name"]: effect for effect in cromosim.effects()}
    assert {"accel_bias", "low_pass", "gravity_convention", "time_offset"} <= set(known)
    bias = known["accel_bias"]["parameters"][0]
    assert (bias["name"], bias["unit"]) == ("bias", "m/s2")
    assert all(effect["summary"] for effect in known.values())


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: Device({"accel_bais": {"bias": [0, 0, 0]}}), ["accel_bais"]),
        (lambda: Device({"accel_bias": {"bios": [0, 0, 0]}}), ["bios"]),
        (lambda: Device(accel_density=-1), ["accel_density"]),
        (lambda: cromosim.apply_device("gold", STAMPS, STILL, ZERO), ["gold"]),
        (lambda: cromosim.apply_device(None, STAMPS, STILL[:, :2], ZERO), ["specific_force", "(N, 3)"]),
        (lambda: cromosim.apply_device(None, STAMPS, STILL[:5], ZERO), ["specific_force", "5"]),
        (lambda: cromosim.apply_device(None, STAMPS[::-1], STILL, ZERO), ["stamps_s", "row 1"]),
        (lambda: cromosim.apply_device(None, STAMPS, STILL * np.inf, ZERO), ["row 0", "finite"]),
        (
            lambda: cromosim.apply_device(
                Device({"gravity_convention": {"mode": "removed"}}), STAMPS, STILL, ZERO
            ),
            ["orientation", "gravity_convention"],
        ),
    ],
)
def test_errors_are_one_line(call, words):
    with pytest.raises(cromosim.CromosimError) as caught:
        call()
    text = str(caught.value)
    assert "\n" not in text and all(word in text for word in words), text
